#!/usr/bin/env python3
"""Bakes the models of a folder in shares on HyperQueue, and then verifies all grids.

Needs the Python package `hyperqueue`. Without --server it starts a server and workers on this machine;
docs/batches.md explains the options and the same with the command `hq`.
"""

import argparse
import pathlib
import shlex
import sys
import tempfile

from hyperqueue import Client, Job, LocalCluster
from hyperqueue.cluster import WorkerConfig
from hyperqueue.ffi.protocol import ResourceRequest


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("models", type=pathlib.Path, help="the folder of the models")
    parser.add_argument("grids", type=pathlib.Path, help="the folder of the grids")
    parser.add_argument("--shards", type=int, default=4, help="number of shares, a task each")
    parser.add_argument("--cores", type=int, default=1, help="cores of a task")
    parser.add_argument("--workers", type=int, default=2, help="local workers, of --cores each")
    parser.add_argument("--server", help="the folder of a running server, instead of local workers")
    parser.add_argument("--aogrid", default="aogrid", help="the command, or its path")
    parser.add_argument("--bake", default="", help="more options of bake, in one word")
    return parser.parse_args()


def job(args, logs):
    """Returns a job with a task for each share and one that verifies what they made."""
    # Without max_fails the first share that fails would cancel the others.
    job = Job(max_fails=None, name="aogrid")
    cores = ResourceRequest(cpus=args.cores)
    shares = []
    for shard in range(1, args.shards + 1):
        share = f"{shard}/{args.shards}"
        command = [args.aogrid, "bake", str(args.models.resolve()), "-o", str(args.grids.resolve())]
        command += ["--shard", share, "--backend", "cpu", "--threads", str(args.cores), "--quiet"]
        log = str(logs / f"{shard}.log")
        shares.append(
            job.program(command + shlex.split(args.bake), name=share, stderr=log, stdout=log, resources=cores)
        )
    verify = [args.aogrid, "verify", str(args.grids.resolve())]
    log = str(logs / "verify.log")
    job.program(verify, name="verify", deps=shares, stderr=log, stdout=log, resources=cores)
    return job


def run(client, args):
    """Runs the job; returns whether all of it succeeded, and prints what the shares that failed say."""
    with tempfile.TemporaryDirectory() as logs:
        submitted = client.submit(job(args, pathlib.Path(logs)))
        if client.wait_for_jobs([submitted], raise_on_error=False):
            return True
        for task, failure in sorted(client.get_failed_tasks(submitted).items()):
            print(f"task {task}: {failure.error}", file=sys.stderr)
            if failure.stderr and pathlib.Path(failure.stderr).exists():
                print(pathlib.Path(failure.stderr).read_text(), end="", file=sys.stderr)
        return False


def main():
    args = arguments()
    args.grids.mkdir(parents=True, exist_ok=True)
    if args.server:
        return run(Client(args.server), args)
    with LocalCluster() as cluster:
        for _ in range(args.workers):
            cluster.start_worker(WorkerConfig(cores=args.cores))
        return run(cluster.client(), args)


if __name__ == "__main__":
    sys.exit(0 if main() else 1)
