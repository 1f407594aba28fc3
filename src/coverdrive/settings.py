"""The base of every settings model: frozen, and unknown keys are errors.

Each part of the package owns one such model; `coverdrive.config` puts them together into one experiment.
"""

from pydantic import BaseModel, ConfigDict


class Settings(BaseModel):
    """Immutable settings with the paper's constants as defaults."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)
