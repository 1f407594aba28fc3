"""Runs a study on a local Dask cluster, kills a worker midway: ``python run_cluster_study.py FOLDER TRIALS SEED``."""

import os
import signal
import sys
from pathlib import Path

from distributed import Client, LocalCluster
from simulation_fakes import fakes

from coverdrive.progress import heard_by
from coverdrive.simulation.studies.study import Study

KILL_AT = 5
"""finished trials after which a worker is killed"""


def main() -> None:
    folder, trials, seed = sys.argv[1], *map(int, sys.argv[2:])
    with LocalCluster(n_workers=3, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster:
        with Client(cluster, set_as_default=False) as client:
            pids = client.run(os.getpid)

        def kill_one(_: str, share: float) -> None:
            if round(share * trials) == KILL_AT:
                os.kill(next(iter(pids.values())), signal.SIGKILL)
                print("killed", flush=True)

        with heard_by(kill_one):
            Study(fakes(seed=seed), Path(folder)).run(trials, cluster=cluster.scheduler_address)
        with Client(cluster, set_as_default=False) as client:
            after = client.run(os.getpid)
        print("survivors", len(set(pids.values()) & set(after.values())), flush=True)


if __name__ == "__main__":
    main()
