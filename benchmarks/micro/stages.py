# SPDX-License-Identifier: Apache-2.0
"""What `make bench` prints and keeps: the time of each stage, what part of its limit it reaches, and its time over that
of an earlier run.

The limits are of one core, measured in the same run: fused multiply-adds on registers for stages that tell their
floating-point operations (`flops`), the bandwidth of memory for those that tell the bytes they read (`bytes`), and for
whole paths (`rays` per second) the nearest hits of camera rays of the same scene, which are Embree and little else. The
time of a stage is the least processor time of its repetitions; of one that uses all threads (`real_time`), time by the
clock.

    stages.py --out FILE [--baseline FILE] [--program TEXT] JSON...

JSON: files that Google Benchmark wrote (`--benchmark_out`), those of machine_bench among them.
"""
import argparse
import json
import pathlib
import sys

SECONDS = {"ns": 1e-9, "us": 1e-6, "ms": 1e-3, "s": 1.0}
ARITHMETIC, MEMORY = "multiply_add", "read_array/268435456"


def best_runs(runs):
    """The fastest run of each name, with its `seconds`."""
    best = {}
    for run in runs:
        if run.get("run_type") == "aggregate" or run.get("error_occurred"):
            continue
        name = run["run_name"]
        time = run["real_time" if name.endswith("/real_time") else "cpu_time"] * SECONDS[run["time_unit"]]
        if name not in best or time < best[name]["seconds"]:
            best[name] = {**run, "seconds": time}
    return best


def limit_of(run, best):
    """(What limits a stage, the part of it that is reached), or None where it does not tell or was not measured."""
    name = run["run_name"]
    if "flops" in run and ARITHMETIC in best:
        return "arithmetic", run["flops"] / best[ARITHMETIC]["items_per_second"]
    if "bytes" in run and MEMORY in best:
        return "memory", run["bytes"] / best[MEMORY]["bytes_per_second"]
    hits = best.get(name.replace("paths/", "nearest_hits/", 1))
    if name.startswith("paths/") and "rays" in run and hits:
        return "rays", run["rays"] / hits["items_per_second"]
    return None


def summarize(runs):
    best = best_runs(runs)
    stages = {}
    for name, run in best.items():
        stages[name] = {"seconds": run["seconds"]}
        limit = limit_of(run, best)
        if limit:
            stages[name] |= {"limit": limit[0], "of_limit": limit[1]}
    return stages


def table(stages, baseline):
    """Lines of a table of Markdown. `baseline`: stages of an earlier run; may be empty."""
    lines = ["| stage | ms | of its limit | over the earlier run |", "|---|---|---|---|"]
    for name, stage in stages.items():
        part = f"{stage['of_limit']:.0%} of {stage['limit']}" if "limit" in stage else ""
        ratio = f"{stage['seconds'] / baseline[name]['seconds']:.2f}" if name in baseline else ""
        lines.append(f"| {name} | {1e3 * stage['seconds']:.4g} | {part} | {ratio} |")
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=pathlib.Path, metavar="JSON")
    parser.add_argument("--out", required=True, type=pathlib.Path, help="JSON file of this run")
    parser.add_argument("--baseline", type=pathlib.Path, help="the same of an earlier run")
    parser.add_argument("--program", default="", help="what was measured, for the JSON file")
    arguments = parser.parse_args()
    results = [json.loads(file.read_text()) for file in arguments.files]
    stages = summarize([run for result in results for run in result["benchmarks"]])
    baseline = {}
    if arguments.baseline:
        baseline = json.loads(arguments.baseline.read_text()).get("stages")
        if baseline is None:
            sys.exit(f"stages.py: {arguments.baseline} holds no stages; expected a file that `make bench` wrote")
    context = results[0]["context"]
    arguments.out.write_text(json.dumps({"program": arguments.program, "date": context["date"],
                                         "processors": context["num_cpus"], "stages": stages}, indent=1) + "\n")
    print("\n".join(table(stages, baseline)))


if __name__ == "__main__":
    main()
