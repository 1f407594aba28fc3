"""The dial: one number λ scales every predicted set, and what drives risk at each is measured and proved.

Small sets are fast and miss more; large ones leave no clear plan in dense traffic, and who has none cannot choose. So
the risk of drives need not be monotone in λ, and nothing here takes it to be. Pilot drives at every λ of a grid order
them; drives of other seeds prove (`coverdrive.certificates.learn_then_test`). What a certificate says about windows of
recorded traffic at that λ stands beside, and neither stands for the other.

The folder of a dial holds ``pilot/`` and ``proof/``, with a study in each for every λ, ``frontier.csv`` with a line for
each, and ``dial.json`` with what is proved.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
import polars as pl

from coverdrive.arguments import finite, of_kind, path_of, shown, whole
from coverdrive.certificates.certificate import Certificate
from coverdrive.certificates.drives import Procedure, Proof, drives_needed, limit_of
from coverdrive.certificates.learn_then_test import Asked, Dial, Tried
from coverdrive.dialling.frontier import OURS, frontier
from coverdrive.dialling.splitting import IN_VAIN
from coverdrive.errors import CertificateError, DataError, SettingError
from coverdrive.files import write_json, write_stream
from coverdrive.locks import alone
from coverdrive.prediction.stored import checked_scale
from coverdrive.progress import stage
from coverdrive.recordings.recording import Recording
from coverdrive.simulation.drives.episode import EpisodeSettings
from coverdrive.simulation.measures.notable import COLLIDED, OWN_FAULT
from coverdrive.simulation.measures.trial import STARTED
from coverdrive.simulation.predictor import Scalable
from coverdrive.simulation.studies.driven_on import driven_on
from coverdrive.simulation.studies.folder import StudyFolder, flat
from coverdrive.simulation.studies.setup import AnyPlanner, AnyTraffic, Setup
from coverdrive.simulation.studies.study import drive_missing, setup_of

SCALES = (0.0, 0.15, 0.3, 0.45, 0.6, 0.8, 1.0)
"""λ that are tried if nobody names others"""

Event = Literal["any", "own"]
"""Any collision of the ego, or one at its own fault"""

_STREAMS = {"pilot": 1, "proof": 2}
"""keys of the seeds of both, which are no study's"""

_GAIN = 0.01
"""share by which a bolder λ has to be faster in the pilot to be worth the drives of a proof"""

_BATCH = 10
"""drives at least between two looks at what is proved"""

_EVENTS = {"any": ("touch anybody", COLLIDED), "own": ("touch somebody at the ego's fault", OWN_FAULT)}


@dataclass(frozen=True)
class Dialled:
    """What drives were proved to risk, and with which sets."""

    scale: float
    """λ of the sets"""
    reached: bool
    """whether the risk that was asked for is proved"""
    proofs: tuple[Proof, ...]
    """of collisions, and of those at the ego's fault"""
    mean_speed: float
    """[m/s] of the drives of the proof"""
    windows: Certificate
    """what is proved of recorded traffic at that λ"""
    place: str
    """on which road, among how many vehicles the drives of the proof could start, in a sentence"""
    driven: Mapping[str, Any]
    """everything that the drives depended on but their seed, by name"""
    frontier: pl.DataFrame
    """risk and speed at every λ (`coverdrive.dialling.frontier`)"""
    other_proofs: int = 0
    """proofs of other seeds that were begun in the same traffic, with sets of the same fit"""

    @property
    def sentence(self) -> str:
        """What is proved of drives, and where."""
        said = " ".join(f"{proof.sentence}." for proof in self.proofs)
        said = f"{said} Driven at {self.mean_speed:.1f} m/s with sets of scale {self.scale:g}. {self.place}"
        if not self.other_proofs:
            return said
        return f"{said} In this folder {self.other_proofs + 1} such proofs were begun: each has that confidence alone."

    def unlike(self, setup: Setup) -> dict[str, tuple[Any, Any]]:
        """What other drives depend on that is not as it was proved, by dotted names: as proved, and there."""
        here = flat(json.loads(json.dumps(setup.description() | {"seed": None})))
        proved = flat({**self.driven, "seed": None})
        different = [name for name in proved | here if proved.get(name) != here.get(name)]
        different.sort(key=lambda name: (not name.endswith("kind"), name))
        return {name: (proved.get(name), here.get(name)) for name in different}

    @property
    def record(self) -> dict[str, Any]:
        """As JSON values, the first proof's numbers by themselves."""
        first = self.proofs[0]
        numbers = {
            "risk": first.bound,
            "confidence": first.confidence,
            "drives": first.drives,
            "collisions": first.events,
        }
        said = {"sentence": self.sentence, "windows": self.windows.sentence, "certificate": asdict(self.windows)}
        own = {"proofs": [asdict(each) for each in self.proofs], "frontier": self.frontier.to_dicts()}
        return {**vars(self), **numbers, **said, **own}

    @staticmethod
    def of(record: Mapping[str, Any]) -> "Dialled":
        """The one that a record is of."""
        own: dict[str, Any] = {
            "proofs": tuple(Proof(**each) for each in record["proofs"]),
            "windows": Certificate(**record["certificate"]),
            "frontier": pl.DataFrame(record["frontier"], infer_schema_length=None),
        }
        return Dialled(**{each.name: record[each.name] for each in fields(Dialled) if each.name in record} | own)


@dataclass(frozen=True)
class Request:
    """What is to be proved, and how; checked when made."""

    risk: float = 0.01
    """probability of the event in a drive that is to be proved not to be exceeded"""
    confidence: float = 0.99
    event: Event = "any"
    """what must not happen more often; of the other event stands what is proved, too"""
    scales: Sequence[float] = SCALES
    """λ to try; one alone is named beforehand, and needs no pilot"""
    procedure: Procedure | None = None
    """how several are kept from being tried until one passes by chance; else anytime, or named beforehand if there is
    one"""
    pilot: int = 100
    """pilot drives at every λ"""
    most: int | None = None
    """drives to prove one λ at the most; else twice as many as are needed without an event, or, of one that is named
    beforehand, just as many; rounded up, so that every number of vehicles is driven among as often"""

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        try:
            scales = tuple(map(checked_scale, self.scales))
        except TypeError:
            raise SettingError(f"a dial needs scales, got {shown(self.scales)}; try (0.3, 0.6, 1)") from None
        if not scales or len(set(scales)) < len(scales):
            raise SettingError(f"a dial needs scales that differ, got {list(scales)}; try 0.3 0.6 1")
        object.__setattr__(self, "scales", scales)
        for name in ("risk", "confidence"):
            object.__setattr__(self, name, finite(name, getattr(self, name)))
        for name, known in (("event", get_args(Event)), ("procedure", (None, *get_args(Procedure)))):
            if (value := getattr(self, name)) not in known:
                raise SettingError(f"{name}: expected {' or '.join(map(repr, known))}, got {shown(value)}")
        object.__setattr__(self, "pilot", whole("pilot", self.pilot))
        if self.most is not None:
            object.__setattr__(self, "most", whole("most", self.most))

    @property
    def events(self) -> tuple[Event, ...]:
        """What is counted: who asks of any collision is told of those at the ego's fault as well."""
        return ("any", "own") if self.event == "any" else ("own",)

    def dial(self, duration: float, turn: int = 1) -> Dial:
        """The procedure, for drives of a length [s] among so many numbers of vehicles in turn, of which each is driven
        among as often as any other.
        """
        asked = tuple(Asked(_EVENTS[event][0], self.risk) for event in self.events)
        procedure = self.procedure or ("anytime" if len(self.scales) > 1 else "named beforehand")
        alone = 1 if procedure != "Holm" else len(self.scales)
        needed = drives_needed(0, self.risk, 1 - (1 - self.confidence) / alone, procedure == "anytime")
        usual = needed if procedure == "named beforehand" else 2 * needed
        most = math.ceil(usual / turn) * turn if self.most is None else self.most
        return Dial(
            asked,
            self.confidence,
            procedure,
            self.pilot,
            most,
            max(_BATCH, needed // 20),
            gain=_GAIN,
            unit=_unit(duration),
        )


def dial(
    predictor: Scalable,
    planner: AnyPlanner | None = None,
    *,
    folder: Path | str,
    risk: float = 0.01,
    confidence: float = 0.99,
    event: Event = "any",
    scales: Sequence[float] = SCALES,
    procedure: Procedure | None = None,
    pilot: int = 100,
    most: int | None = None,
    traffic: AnyTraffic = "set-sampling",
    vehicles: int | Sequence[int] | None = None,
    seed: int = 0,
    recordings: Sequence[Recording] = (),
    road: str | None = None,
    episode: EpisodeSettings | None = None,
    workers: int = 1,
    cluster: str | None = None,
) -> Dialled:
    """Find the boldest scale of the predictor's sets with which drives are proved to be safe enough.

    What is proved drives as ``predictor.scaled(result.scale)`` and this planner; ``result.reached`` says whether it is
    what was asked for. All else is as of `coverdrive.study`, and of `Request`.

    Args:
        predictor: whose sets are scaled.
        planner: of the ego.
        folder: of this dial, which goes on where it was stopped.
        risk: probability of a collision in a drive that is to be proved not to be exceeded.
        confidence: of the proof.
        event: ``any`` collision, or those at the ego's ``own`` fault.
        scales: to try; one alone is named beforehand.
        procedure: how several are kept from being tried until one passes by chance.
        pilot: drives at every scale that choose.
        most: drives to prove one at the most.
        traffic: in which is driven.
        vehicles: numbers of uncontrolled vehicles.
        seed: of both kinds of drives, which no study with this seed has.
        recordings: on a road like theirs.
        road: another one.
        episode: start, length and time steps.
        workers: number of processes.
        cluster: address of a Dask scheduler.

    Raises:
        SettingError: a number makes no sense, there is no such traffic or road, or hardly any drive can start.
        CertificateError: so many drives cannot prove the risk, whatever happens in them, or they are replays.
        DataError: the folder holds drives of another configuration, or another process drives in it.
    """
    of_kind("predictor", predictor, Scalable, "a predictor with sets of any scale (predict, certificate, scaled)")
    setup = setup_of(predictor, planner, traffic, vehicles, seed, recordings, road, episode)
    request = Request(risk, confidence, event, scales, procedure, pilot, most)
    return dialled(setup, predictor, path_of("folder", folder), request, workers, cluster)


def dialled(
    setup: Setup,
    predictor: Scalable,
    folder: Path,
    request: Request,
    workers: int = 1,
    cluster: str | None = None,
    beside: Mapping[tuple[str, float | None], Setup] | None = None,
) -> Dialled:
    """Drive the pilot and the proof, as far as the folder does not hold them yet, and say what is proved.

    Args:
        setup: of the drives; its predictor is replaced by ``predictor`` at every scale, its seed by others.
        predictor: whose sets are scaled.
        folder: of this dial.
        request: what is to be proved.
        workers: number of processes.
        cluster: address of a Dask scheduler whose workers drive instead.
        beside: others of the frontier, by name and scale, that pilot drives are driven of.

    Raises:
        SettingError: a number makes no sense, or hardly any drive can start.
        CertificateError: so many drives cannot prove the risk, whatever happens in them, or they are replays.
        DataError: the folder holds drives of another configuration, or another process drives in it.
    """
    if setup.replays:
        raise CertificateError(
            "replays of recorded scenes depend on each other, so that counting them proves nothing; dial in another "
            "traffic, or choose a scale on groups of scenes by `coverdrive dial --traffic replay`"
        )
    setup, dial = setup.loaded(), request.dial(setup.episode.duration, len(setup.vehicles))
    dial.check(len(request.scales))
    if whole("workers", workers) < 1:
        raise SettingError(f"a dial needs at least one worker, got {workers}")
    scales, tables = request.scales, dict[tuple[str, str, float | None], pl.DataFrame]()
    most = {"pilot": dial.pilot, "proof": dial.most}

    def at(scale: float, kind: str) -> Setup:
        return replace(setup, predictor=predictor.scaled(scale), seed=_seed(setup.seed, kind))

    def driven(key: tuple[str, str, float | None], setup: Setup, name: str, told: str, started: int) -> pl.DataFrame:
        """The trials in a folder of a kind, until so many have started; those that cannot start are no drives."""
        kind, files = key[0], StudyFolder(folder / key[0] / name)
        if (table := tables.get(key)) is None:
            files.claim(setup.description())
            table = files.table_of([])
        with stage(f"{kind} {told} ({most[kind]} at most)"):
            while (missing := started - (begun := table.select(STARTED.sum()).item())) > 0:
                if table.select((STARTED.cum_sum(reverse=True) == 0).sum()).item() >= IN_VAIN:
                    raise SettingError(
                        f"{begun:,} of {table.height:,} trials could start, none of the last {IN_VAIN}; {missing:,} "
                        "more are needed: dial among fewer vehicles, or in other traffic (the last one: "
                        f"{table['reason'][-1]})"
                    )
                end = table.height + (missing if begun else min(missing, IN_VAIN))
                table = drive_missing(table, end, files, setup, workers, cluster, most[kind] + table.height - begun)
        files.save_table(table)
        tables[key] = table
        return table.filter(STARTED)

    def drive(kind: str, candidate: int, first: int, count: int) -> tuple[np.ndarray, np.ndarray]:
        scale = scales[candidate]
        key, name, told = (kind, OURS, scale), f"{scale:g}", f"at scale {scale:g}"
        rows = driven(key, at(scale, kind), name, told, first + count)[first : first + count]
        measures = [_EVENTS[event][1].alias(event) for event in request.events]
        if kind == "pilot":
            measures.append(pl.col("share_unsafe"))
        return rows.select(measures).to_numpy(), rows["mean_speed"].to_numpy()

    with alone(folder):
        _claim(folder / "request.json", request, dial)
        turned = dial.turn(len(scales), partial(drive, "pilot"), partial(drive, "proof"))
        for (name, scale), other in (beside or {}).items():
            key, given = ("pilot", name, scale), replace(other, seed=_seed(setup.seed, "pilot"))
            if scale is None:
                driven(key, given, name, f"of {name}", dial.pilot)
            else:
                driven(key, given, f"{name}-{scale:g}", f"of {name} at scale {scale:g}", dial.pilot)
    tried: Tried = turned.chosen or turned.tried[0]
    scale = scales[tried.candidate]
    began = {setup.vehicles_of(trial) for trial in tables["proof", OURS, scale].filter(STARTED)["trial"]}
    result = Dialled(
        scale=scale,
        reached=tried.reached,
        proofs=tried.proofs,
        mean_speed=tried.speed,
        windows=predictor.scaled(scale).certificate,
        place=driven_on(replace(setup, vehicles=sorted(began))),
        driven={name: each for name, each in at(scale, "proof").description().items() if name != "seed"},
        frontier=frontier(tables, predictor, dial.procedure == "anytime"),
    )
    write_json(folder / "dial.json", result.record)
    write_stream(folder / "frontier.csv", result.frontier.write_csv)
    return result


def _claim(file: Path, request: Request, dial: Dial) -> None:
    """Say what the drives of a folder are to prove, or refuse to let them prove another thing once they were looked at.

    At any time more drives may be asked for.
    """
    own = ("risk", "confidence", "event", "scales", "pilot")
    asked = {name: getattr(request, name) for name in own} | {"procedure": dial.procedure}
    if dial.procedure != "anytime":
        asked["most"] = dial.most
    if not file.exists():
        write_json(file, asked)
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise DataError(f"{file} does not say what is to be proved ({error}); dial with another seed") from error
    if found != json.loads(json.dumps(asked)):
        raise DataError(
            f"the drives in {file.parent} were asked for {found}, now {asked}: who has seen them cannot let them prove "
            "another thing; dial with another seed, in a folder of its own, whose drives are new"
        )


def proof_of(trials: pl.DataFrame, duration: float, anytime: bool = False, confidence: float = 0.99) -> Proof:
    """What the drives of a study prove of collisions: their number was fixed, or they may end ``anytime``."""
    hits = trials.select(COLLIDED).to_series().to_numpy()
    bound, method = limit_of(hits, confidence, anytime), "anytime" if anytime else "named beforehand"
    return Proof(_EVENTS["any"][0], int(hits.sum()), len(hits), bound, bound, confidence, method, _unit(duration))


def said_of_dial(proved: Dialled | None, setup: Setup, most: int = 3) -> list[str]:
    """What was proved of drives with these sets, if anything, and in what the drives of a setup are others."""
    if proved is None:
        return []
    unlike = proved.unlike(setup)
    named = "; ".join(f"{name} {was!r}, now {now!r}" for name, (was, now) in list(unlike.items())[:most])
    more = f" ({len(unlike)} settings in all)" if len(unlike) > most else ""
    others = [f"These drives are others than those that were proved: {named}{more}"]
    return [proved.sentence, *(others if unlike else [])]


def _unit(duration: float) -> str:
    return f"{duration:g}-s drives"


def _seed(seed: int, kind: str) -> int:
    """Seed of the drives of the pilot or of the proof, which no study has."""
    key = 2**32 - _STREAMS[kind]
    return int(np.random.SeedSequence(seed, spawn_key=(key,)).generate_state(1, np.uint64)[0] >> 1)
