"""The settings with which the tables of the paper are repeated."""

from coverdrive.certificates.methods import Method
from coverdrive.prediction.certifying.calibrate import CertificateSettings
from coverdrive.prediction.data.segments import SegmentSettings
from coverdrive.prediction.data.split import SplitSettings
from coverdrive.prediction.fit import PredictionSettings


def paper_settings() -> PredictionSettings:
    """The paper's labels, network and loss, overlapping windows, and a calibration side as large as in its Table 1.

    At this stride, seven twentieths of the generated scenes hold more than its 63,786 calibration samples.
    """
    return PredictionSettings.paper().model_copy(
        update={
            "segments": SegmentSettings(stride=0.1),
            "split": SplitSettings(train=0.35, calibration=0.35),
            "certificate": CertificateSettings(method=Method.POST_BLOATING, unit="window"),
        }
    )
