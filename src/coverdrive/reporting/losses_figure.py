"""How the loss fell in training."""

import numpy as np

from coverdrive.prediction.learned import Learned
from coverdrive.reporting.figure import Axis, Figure, Line, Panel, Points


def losses_figure(learned: Learned) -> Figure:
    """The mean training loss of every epoch."""
    epochs = np.arange(1, len(learned.losses) + 1)
    hover = [f"epoch {epoch}: {loss:.4g}" for epoch, loss in zip(epochs, learned.losses, strict=True)]
    marks = [Line(x=epochs, y=learned.losses), Points(x=epochs, y=learned.losses, size=2.5, hover=hover)]
    panel = Panel(marks, Axis("epoch"), Axis("loss", log=True))
    return Figure([[panel]], height=2.6, caption="Mean training loss of every epoch.")
