"""The traffics by name: of each the file beside this one, and in it the settings of its kind and the model."""

TRAFFICS = {
    "set-sampling": ("set_sampling", "SetSamplingSettings", "SetSamplingTraffic"),
    "drivers": ("driver_traffic", "DriverTrafficSettings", "DriverTraffic"),
    "aggressive": ("driver_traffic", "AggressiveTrafficSettings", "DriverTraffic"),
    "mixed": ("mixed", "MixedTrafficSettings", "MixedTraffic"),
    "replay": ("replay", "ReplaySettings", "ReplayTraffic"),
    "reactive-replay": ("reactive_replay", "ReactiveReplaySettings", "ReactiveReplayTraffic"),
}
"""A model is made with what it names of ``settings``, ``predictor`` (with the sets of which it drives members) and
``scenarios`` (recorded ones)."""
