"""A results folder, and its one owner: names, format, fingerprints, and what is saved once.

``manifest.json`` (`coverdrive.sealed`) · ``config.toml`` (all settings) · ``run.json``
(versions, data, times) · ``predictor.safetensors`` · ``scores.safetensors`` (of every side of the split) ·
``certificate.json`` · ``seen.parquet`` (tracks of all that trained or calibrated) · ``learned.safetensors`` (what
pictures of the fit show) · ``methods.json`` (all methods of
calibration) · ``study/`` (`coverdrive.simulation.studies.folder`) · ``dialled.json`` (what drives are proved to risk) ·
``dial/`` (`coverdrive.dialling.dial`) · ``league/`` (`coverdrive.league.league`) ·
``figures/`` · ``report.html``.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import polars as pl
from pydantic import BaseModel, TypeAdapter

from coverdrive.aside import bring_back, current, remove_drawn, remove_pages, set_aside
from coverdrive.certificates.comparison import Compared
from coverdrive.certificates.drives import drives_needed
from coverdrive.certificates.evaluation import evaluate
from coverdrive.config import Experiment
from coverdrive.dialling.dial import Dialled, Request, dialled
from coverdrive.dialling.frontier import setups_beside
from coverdrive.dialling.groups import ChosenOnGroups, across_groups, chosen_share
from coverdrive.errors import CoverdriveError, DataError, SettingError
from coverdrive.files import write_json, write_stream
from coverdrive.league.entrants import Known
from coverdrive.league.known import known_of, paper_settings_like
from coverdrive.league.table import SCHEMA
from coverdrive.locks import alone
from coverdrive.planning.planner import MpcPlanner, PlannerSettings
from coverdrive.prediction.certifying.scored import ScoredSides
from coverdrive.prediction.data.held_out import Seen, Source
from coverdrive.prediction.fit import Fit, PredictionSettings, fit, scale_left
from coverdrive.prediction.fits.learned import Learned
from coverdrive.prediction.fits.left_out import legible
from coverdrive.prediction.fits.provenance import provenance
from coverdrive.prediction.predictor import AnyPredictor, Predictor
from coverdrive.reporting.contents import Certified, Fitted
from coverdrive.sealed import SealedFolder, read_made
from coverdrive.simulation.drivers.generated import is_generated
from coverdrive.simulation.roads.places import Place, check_replayed_road, is_replayed_on, place_of
from coverdrive.simulation.studies.folder import StudyFolder
from coverdrive.simulation.studies.setup import Setup
from coverdrive.simulation.studies.study import Study
from coverdrive.simulation.traffic.replay import REPLAYS, Scenario, cut_scenarios

CONFIG, RUN = "config.toml", "run.json"
PREDICTOR, SCORES, LEARNED = "predictor.safetensors", "scores.safetensors", "learned.safetensors"
CERTIFICATE, METHODS, METHODS_TABLE = "certificate.json", "methods.json", "methods.csv"
SEEN = "seen.parquet"
"""the tracks of all that trained or calibrated"""
LEAGUE = "league"
"""folder of the league, unless it has another one"""
DIAL, DIALLED = "dial", "dialled.json"
"""folder of drives, named like studies, and what they prove of the predictor"""
STUDY = "study"
"""the study in the traffic of the folder's settings; one in another traffic is called ``study-drivers`` or the like"""
RARE = "rare"
"""folder of estimates of rare collisions, named like studies"""
PAPER = "paper-fit"
"""folder of the paper's preset on the same recordings"""
SWEEP = "sweep"
"""folder of studies that vary settings, named like studies"""
_DRIVEN = (STUDY, SWEEP, RARE, LEAGUE)
"""what drives with the sets of the folder"""
_PARTS = ("planner", "traffic", "episode", "seed")
"""settings that a study describes besides its numbers of vehicles"""


class _Run(BaseModel):
    """What ``run.json`` holds."""

    coverdrive: str
    python: str
    packages: dict[str, str]
    seed: int
    recordings: tuple[Source, ...]
    seconds: dict[str, float]
    road: str = "paper"
    """of studies, if no other is named"""
    recorded_place: Place | None = None
    """like that of the recordings, if the fit was to any"""
    recorded_near_misses: dict[str, float] | None = None


_OBJECT, _CERTIFIED = TypeAdapter(dict[str, Any]), TypeAdapter(Certified)
_METHODS = TypeAdapter(dict[Literal["methods"], list[Compared]])


class Results:
    """Reads and writes the files of one results folder."""

    def __init__(self, folder: Path | str):
        """Name the folder; it is made as needed."""
        self.folder = Path(folder)
        self._sealed = SealedFolder(self.folder)

    # what a fit leaves

    def save_fit(
        self, experiment: Experiment, fit: Fit, road: str = "paper", like: Place | None = None,
        near_misses: dict[str, float] | None = None,
    ) -> None:  # fmt: skip
        """Write a fit and the settings that it was made with; whatever the folder held of another one is void.

        Pages and figures of another fit go; what drove with other sets or settings is set aside, each beside its
        folder. ``road`` is the name of the road of studies, ``like`` a place like that of the recordings,
        ``near_misses`` what `coverdrive.simulation.measures.notable.recorded_near_misses` says of them.
        """
        if self.holds_fit:
            self._make_room(experiment, fit.predictor, road)
        self._sealed.unseal()
        remove_pages(self.folder)
        for name in (METHODS, METHODS_TABLE, DIALLED, f"{LEAGUE}/{LEAGUE}.csv", f"{LEAGUE}/{LEAGUE}.html"):
            (self.folder / name).unlink(missing_ok=True)
        remove_drawn(self.folder / LEAGUE, LEAGUE)
        experiment.save(self.folder / CONFIG)
        fit.predictor.save(self.folder / PREDICTOR)
        fit.scored.save(self.folder / SCORES)
        Learned.of(fit).save(self.folder / LEARNED)
        write_json(self.folder / CERTIFICATE, certificate_record(Certified.of(fit)))
        about = {"road": road, "recorded_place": like and like.model_dump(mode="json")}
        about |= {"recorded_near_misses": near_misses}
        write_json(self.folder / RUN, provenance(fit) | about)
        fit.seen.save(self.folder / SEEN)
        self._seal(CONFIG, PREDICTOR, SCORES, LEARNED, CERTIFICATE, RUN, SEEN)

    def _make_room(self, experiment: Experiment, predictor: AnyPredictor, road: str) -> None:
        """Set aside what drove with other sets, or with settings that studies called ``study`` no longer have."""
        try:
            ours, before, scale = self.experiment, self.predictor, f"{self.predictor.scale:.3g}"
            alike = experiment.study.vehicles == ours.study.vehicles and road == self._run.road
        except CoverdriveError:  # a damaged fit is another one
            set_aside(self.folder, "unknown", *_DRIVEN, DIAL, PAPER)
            return
        alike &= all(getattr(experiment, part) == getattr(ours, part) for part in _PARTS)
        if predictor.scaled(1.0).fingerprint != before.scaled(1.0).fingerprint:
            set_aside(self.folder, scale, *_DRIVEN, DIAL, PAPER)
        elif predictor.scale != before.scale or not alike:
            set_aside(self.folder, scale, *_DRIVEN)

    @property
    def holds_fit(self) -> bool:
        """Whether there is a fit."""
        return self._sealed.exists

    @cached_property
    def experiment(self) -> Experiment:
        """The settings that the fit was made with."""
        return Experiment.load(self._sealed.file(CONFIG))

    @cached_property
    def predictor(self) -> AnyPredictor:
        """The certified predictor."""
        return Predictor.load(self._sealed.file(PREDICTOR))

    @cached_property
    def scored(self) -> ScoredSides:
        """Scores of every side of the split."""
        return ScoredSides.load(self._sealed.file(SCORES), self.predictor)

    @cached_property
    def learned(self) -> Learned:
        """What pictures of the fit show."""
        return Learned.load(self._sealed.file(LEARNED))

    @cached_property
    def certified(self) -> Certified:
        """The certificates, and how they did on scenes that did not train it."""
        return self._sealed.read(CERTIFICATE, _CERTIFIED.validate_json)

    @cached_property
    def _run(self) -> _Run:
        return self._sealed.read(RUN, _Run.model_validate_json)

    @property
    def run(self) -> dict[str, Any]:
        """Versions, data and times."""
        return self._run.model_dump(mode="json")

    def refuse_seen(self, scenarios: Sequence[Path]) -> None:
        """Raise `DataError` if CommonRoad scenarios show vehicles that trained or calibrated the predictor.

        Those that cannot be read as recordings are passed over. No scenario shows vehicles of generated traffic, whose
        tracks a demo leaves out.
        """
        if self._is_demo:
            return
        read = self.experiment.recordings
        self.seen.refuse([each for file in scenarios if legible(file) for each in read([file])])

    @property
    def _is_demo(self) -> bool:
        return not (self.folder / SEEN).exists() and all(is_generated(each.name) for each in self._run.recordings)

    @cached_property
    def seen(self) -> Seen:
        """What trained or calibrated the predictor, which is refused wherever it is to be tried."""
        if self._is_demo:
            raise DataError(
                f"{self.folder} is a demo, which does not keep what it was made from: to replay recordings, make a fit "
                "with `coverdrive fit` in another folder"
            )
        return Seen.load(self._sealed.file(SEEN), self._run.recordings)

    def place(self, road: str | None = None) -> Place:
        """Where a study on a road of a name takes place, or on that of the fit; a SettingError if there is none."""
        return place_of(road or self._run.road, self._run.recorded_place)[1]

    @property
    def settings(self) -> PredictionSettings:
        """Those that the fit was made with."""
        return self.experiment.prediction

    @property
    def seed(self) -> int:
        """That the fit was made with."""
        return self.experiment.seed

    @property
    def fitted(self) -> Fitted:
        """All of it, as pictures show it."""
        return Fitted(
            name=self.folder.resolve().name,
            folder=self.folder,
            run=self.run,
            settings=self._sealed.file(CONFIG).read_text(encoding="utf-8"),
            predictor=self.predictor,
            certified=self.certified,
            learned=self.learned,
            compared=self.methods,
            dialled=self.dialled,
            league=self.league,
        )

    @property
    def league(self) -> pl.DataFrame | None:
        """The table of the league in this folder, if there is one."""
        file = self.folder / LEAGUE / "league.csv"
        return read_made(file, _league_in, "coverdrive league") if file.exists() else None

    # what comparing the methods leaves

    def save_methods(self, compared: Sequence[Compared]) -> None:
        """Write a comparison of methods as JSON, and as a table of one row for each method and target."""
        table = pl.DataFrame([_row(each) for each in compared], infer_schema_length=None)
        write_stream(self.folder / METHODS_TABLE, table.write_csv)
        record = _METHODS.dump_python({"methods": list(compared)}, mode="json")
        self._sealed.replace({METHODS: lambda file: write_json(file, record)})
        self._forget()

    @property
    def methods(self) -> list[Compared]:
        """All methods of calibration side by side; none if they were not compared on this predictor yet."""
        if METHODS not in self._sealed:
            return []
        return self._sealed.read(
            METHODS, lambda content: _METHODS.validate_json(content)["methods"], "coverdrive calibrations"
        )

    # studies

    def study(self, experiment: Experiment, recordings: Sequence[Path] = (), name: str | None = None) -> Study:
        """The study of an experiment, driven or not.

        Args:
            experiment: what to drive.
            recordings: that made the predictor, of which the test scenes are replayed, or new ones; without any, the
                generated traffic that made it.
            name: of its folder; else that of its traffic (`study_name`).
        """

        def scenarios() -> Sequence[Scenario]:
            read = self.experiment.recordings(recordings, stored=True)
            left = self.seen.unseen(read)
            if not left:
                raise DataError(
                    f"nothing of the {len(read)} recordings is left to replay: all of it trained or calibrated the "
                    "predictor, or shows vehicles that did; name entirely new ones with --recording"
                )
            return cut_scenarios(left)

        like = self._run.recorded_place
        setup = Setup(
            self.predictor,
            MpcPlanner(experiment.planner),
            experiment.traffic,
            experiment.episode,
            experiment.study.vehicles,
            experiment.seed,
            scenarios,
            like and like.initial,
        )
        return Study(setup, self.folder / (name or self.study_name(experiment.traffic.kind)))

    def check_replay(self, traffics: Collection[str], recordings: Sequence[Path], road: str | None) -> None:
        """Refuse, with a SettingError, recordings that none of the traffics replays, and a road that is not theirs."""
        if not set(REPLAYS).isdisjoint(traffics):
            check_replayed_road(road, self._run.road)
        elif recordings:
            raise SettingError(
                f"recordings are for replayed traffic only, got {recordings[0]} for {' and '.join(sorted(traffics))}; "
                f"choose --traffic {' or '.join(REPLAYS)}, or leave --recording out"
            )

    def driven_study(
        self, traffic: str | None = None, recordings: Sequence[Path] = (), road: str | None = None
    ) -> Study:
        """A study as it was driven: with its own settings, where they are others than those of the fit.

        Args:
            traffic: in which it was driven; else that of the folder's settings.
            road: on which it was driven; else that of the fit. If neither is named and there is but one study, that.
            recordings: that it replayed; needed if drives have to be driven again.

        Raises:
            DataError: it was driven with another predictor, or not at all.
            SettingError: it replayed none, and recordings are given.
        """
        name = self.study_name(traffic, road)
        if traffic is road is None and not StudyFolder(self.folder / name).exists:
            driven = [each.name for each in current(self.folder, f"{STUDY}-") if StudyFolder(each).exists]
            name = driven[0] if len(driven) == 1 else name
        folder, experiment = StudyFolder(self.folder / name), self.experiment
        if folder.exists:
            described = folder.description()
            if described.get("predictor") != self.predictor.fingerprint:
                raise DataError(
                    f"the study in {folder.path} was driven with another predictor than that in {self.folder}; "
                    f"fit to another folder, or remove the folder `{name}` in it and drive again"
                )
            parts = {part: described.get(part) for part in _PARTS}
            experiment = experiment.updated({"study": {"vehicles": described.get("vehicles")}, **parts})
        elif name != STUDY:
            asked = f" --traffic {traffic}" * bool(traffic) + f" --road {road}" * bool(road)
            raise DataError(
                f"{self.folder} holds no finished study in `{name}`; drive one with "
                f"`coverdrive study {self.folder}{asked}`"
            )
        self.check_replay((experiment.traffic.kind,), recordings, road)
        return self.study(experiment, recordings, name)

    def study_name(self, traffic: str | None, road: str | None = None, kind: str = STUDY) -> str:
        """Folder of the study in a traffic, on a road: that of the folder's settings is called ``study``."""
        names = (traffic, self.experiment.traffic.kind), (road, self._run.road)
        return "-".join([kind, *(asked for asked, usual in names if asked not in (None, usual))])

    def known(
        self,
        names: Collection[str],
        planner: PlannerSettings,
        recordings: Sequence[Path] = (),
        paper: Path | None = None,
        folder: Path | None = None,
    ) -> Known:
        """What entrants of the league may be made of.

        Args:
            names: of those who are to take part; what they need is made.
            planner: ours.
            recordings: that made the predictor, without which there is no box and no paper's preset; generated traffic
                is made again.
            paper: results folder of the paper's preset on them.
            folder: where that is made, if none is given.
        """
        theirs = Results(paper or (folder or self.folder) / PAPER)
        by_paper = paper is None and not theirs.holds_fit and not {"paper", "paper-sets"}.isdisjoint(names)
        needed = self.can_replay(recordings) and (by_paper or "constant-velocity-box" in names)
        read = self.experiment.recordings(recordings, stored=True) if needed else ()
        read = read if read and self.seen.from_all(read) else ()
        if by_paper and read:
            changed = self.experiment.model_copy(update={"prediction": paper_settings_like(self.settings)})
            theirs.save_fit(changed, fit(read, changed.prediction, changed.seed))
        named = theirs.predictor if paper or theirs.holds_fit else None
        return known_of(self.predictor, self.settings, self.seed, read, named, planner)

    def can_replay(self, recordings: Sequence[Path], road: str | None = None) -> bool:
        """Whether there is what the fit was made from, or something else, to replay on its road, and not on another
        one that is asked for; generated traffic is made again, but for a demo.
        """
        known = bool(recordings) or not (self._run.recorded_place or self._is_demo)
        return is_replayed_on(road, self._run.road) and known

    # the dial

    @cached_property
    def dialled(self) -> Dialled | None:
        """What drives were proved to risk with the sets of this predictor, if anything was."""
        if DIALLED not in self._sealed:
            return None
        return self._sealed.read(DIALLED, lambda content: Dialled.of(_OBJECT.validate_json(content)), "coverdrive dial")

    def dial(
        self,
        experiment: Experiment,
        request: Request,
        recordings: Sequence[Path] = (),
        road: str | None = None,
        *,
        workers: int = 1,
        cluster: str | None = None,
        beside: Sequence[str] = (),
    ) -> Dialled:
        """Turn the dial of an experiment, on a road of a name; what is proved is used by everything from then on.

        All is as of `coverdrive.dialling.dial.dialled` and of `study`, but ``beside`` has names of entrants of the
        league, which may need the recordings that made the predictor; a SettingError if there is no such entrant, a
        DataError if the folder holds no scores of its predictor.
        """
        _ = self.scored  # which is needed at the end: without it, all would be driven for nothing
        folder = self.folder / self.study_name(experiment.traffic.kind, road, DIAL) / f"seed-{experiment.seed}"
        setup = self.study(experiment, recordings).setup.loaded()
        others = {}
        if beside:
            known = self.known(beside, experiment.planner, recordings)
            others = setups_beside(setup, known, beside, request.scales)
        found = dialled(setup, self.predictor, folder, request, workers, cluster, others)
        begun = sum((each / "proof").exists() for each in folder.parent.glob("seed-*") if each != folder)
        found = replace(found, other_proofs=begun)
        if found.reached:
            self.save_dialled(found)
        return found

    def choose_on_groups(
        self,
        experiment: Experiment,
        request: Request,
        recordings: Sequence[Path],
        road: str | None = None,
        *,
        workers: int = 1,
        cluster: str | None = None,
    ) -> ChosenOnGroups:
        """Choose the scale on replays of groups of scenes, each driven by what was fitted to all others.

        Too few groups prove nothing of drives. Everything uses the scale from then on. Arguments and errors as of
        `dial`, and a DataError if all scenes share vehicles.
        """
        read = self.experiment.recordings(recordings, stored=True)
        folder = self.folder / self.study_name(experiment.traffic.kind, road, DIAL)
        setup = replace(self.study(experiment, recordings).setup, scenarios=())
        with alone(folder):
            table = across_groups(read, self.settings, setup, folder, request.pilot, workers=workers, cluster=cluster)
        share = chosen_share(table)
        scale = scale_left(self.predictor, self.scored.calibration, share)
        self._use_scale(scale)
        needed = drives_needed(0, request.risk, request.confidence)
        return ChosenOnGroups(share, scale, table["group"].n_unique(), needed, table)

    def save_dialled(self, dialled: Dialled) -> None:
        """Let everything use the sets that were proved; what drove with others is set aside, each beside its folder."""
        self._use_scale(dialled.scale)
        write_json(self.folder / DIALLED, dialled.record)
        self._seal(DIALLED)

    def _use_scale(self, scale: float) -> None:
        """Let the predictor have sets of a scale, of which nothing is proved yet."""
        before, predictor = self.predictor, self.predictor.scaled(scale)
        changed = self.experiment.updated({"prediction": {"scale": predictor.scale}})
        driven = predictor.certificate, evaluate(predictor.rule, self.scored.test, predictor.scale)
        record = certificate_record(replace(self.certified, driven=driven))
        if predictor.scale != before.scale:
            remove_pages(self.folder)
            set_aside(self.folder, f"{before.scale:.3g}", *_DRIVEN)
        written = {CONFIG: changed.save, PREDICTOR: predictor.save, CERTIFICATE: lambda file: write_json(file, record)}
        self._sealed.replace(written, void=(DIALLED,))
        bring_back(self.folder, predictor.fingerprint, predictor.scale)
        self._forget()

    def _seal(self, *names: str) -> None:
        """Seal files that were written; whatever was read before is void."""
        self._sealed.seal(*names)
        self._forget()

    def _forget(self) -> None:
        """Read anew from now on."""
        self.__dict__ = {"folder": self.folder, "_sealed": self._sealed}


def certificate_record(certified: Certified) -> dict[str, Any]:
    """Certificates, and how they did on the test split, as JSON values."""
    return {"sentences": [each.sentence for each in certified.proofs]} | _CERTIFIED.dump_python(certified, mode="json")


def _row(each: Compared) -> dict[str, Any]:
    """A line of the table of methods."""
    missed, evaluation = each.missed, each.evaluation
    return {
        "method": each.method.value,
        "asked": each.target,
        "proved": each.certificate.epsilon if each.certificate else None,
        "observed": missed.value if missed else None,
        "low": missed.low if missed else None,
        "high": missed.high if missed else None,
        "mean_set_size": evaluation.mean_set_size if evaluation else None,
        "mean_area": evaluation.mean_area if evaluation else None,
        "seconds": each.seconds,
        "refusal": each.refusal,
    }


def _league_in(content: bytes) -> pl.DataFrame:
    """The table of the league in a file."""
    if content.partition(b"\n")[0].decode().strip().split(",") != list(SCHEMA):
        raise ValueError("it has other columns")
    table = pl.read_csv(content, schema=SCHEMA)
    if any(table.select("world", "planner", "drives").null_count().row(0)):
        raise ValueError("a row is cut off")
    return table
