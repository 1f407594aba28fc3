"""The settings with which the tables of the paper are repeated."""

from coverdrive.prediction.calibrate import CertificateSettings
from coverdrive.prediction.fit import PredictionSettings
from coverdrive.prediction.segments import SegmentSettings
from coverdrive.prediction.split import SplitSettings
from coverdrive.prediction.training import TrainingSettings


def paper_settings() -> PredictionSettings:
    """The paper's network and loss, overlapping windows, and a calibration side as large as that of its Table 1.

    24 generated scenes of 40 s hold more than the paper's 140,000 segments at this stride, and three tenths of them
    are its 63,786 calibration samples.
    """
    return PredictionSettings(
        segments=SegmentSettings(stride=0.1),
        split=SplitSettings(train=0.4, calibration=0.3),
        training=TrainingSettings(),
        certificate=CertificateSettings(unit="window"),
    )
