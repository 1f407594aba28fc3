"""The version of this package; a module of its own, so that nothing inside asks the façade for it."""

__version__ = "0.2.0"
