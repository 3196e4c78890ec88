#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The overhead of a cluster on this machine: several rounds of a render in one process with one thread, on one Dask
worker, and on two. Prints wall and processor seconds, medians over the rounds; processor time is that of the workers
alone, which is what more workers share."""
import argparse
import json
import resource
import statistics
import time
from pathlib import Path

import covary
import covary.distributed


def processor_seconds():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def here(scene, options):
    covary.set_threads(1)
    before, started = processor_seconds(), time.perf_counter()
    covary.render(scene, options.spp)
    return time.perf_counter() - started, processor_seconds() - before


def on_workers(scene, options, number):
    from distributed import Client, LocalCluster
    with LocalCluster(n_workers=number, threads_per_worker=1, dashboard_address=None) as cluster, \
            Client(cluster) as client:
        client.run(covary.set_threads, 1)
        covary.distributed.render(client, scene, 24, tile=options.tile)  # loads the scene in each worker
        before, started = sum(client.run(processor_seconds).values()), time.perf_counter()
        covary.distributed.render(client, scene, options.spp, tile=options.tile)
        return time.perf_counter() - started, sum(client.run(processor_seconds).values()) - before


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--resolution", default="160x120")
    parser.add_argument("--spp", type=int, default=192)
    parser.add_argument("--tile", type=int, default=40)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    width, height = map(int, options.resolution.split("x"))
    scene = covary.Scene.load(options.scene, resolution=(width, height))
    ways = {"one process": lambda: here(scene, options), "1 worker": lambda: on_workers(scene, options, 1),
            "2 workers": lambda: on_workers(scene, options, 2)}
    seconds = {name: [] for name in ways}
    for _ in range(options.rounds):
        for name, run in ways.items():
            seconds[name].append(run())
    for name, pairs in seconds.items():
        clock, processor = (statistics.median(values) for values in zip(*pairs))
        print(json.dumps({"way": name, "clock_seconds": round(clock, 2), "processor_seconds": round(processor, 2)}))


if __name__ == "__main__":
    main()
