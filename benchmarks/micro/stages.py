# SPDX-License-Identifier: Apache-2.0
"""What `make bench` prints and keeps: the time of each stage, the fraction of its limit that it reaches, and its time
over that of an earlier run.

The limits are those of one core, measured in the same run: fused multiply-adds on registers for stages that report
their floating-point operations (`flops`), memory bandwidth for those that report the bytes they read (`bytes`), and for
whole paths (`rays` per second) the nearest hits of camera rays of the same scene, which are Embree and little else. The
time of a stage is the minimum processor time of its repetitions, or wall time if it uses all threads (`real_time`).

    stages.py --out FILE [--baseline FILE] [--history FILE] [--program TEXT] JSON...

`--history` adds a row to a Markdown table, benchmarks/results.md: the milliseconds of the stages in its header, the
processor, and the fraction of the multiply-add peak as a measure of how busy the machine was. The cell of a stage that
was not run stays empty. Runs on different processors do not compare.

JSON: files that Google Benchmark wrote (`--benchmark_out`), including those of machine_bench.
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
    """(What limits a stage, the fraction of that limit reached), or None if the stage does not report it or the limit
    was not measured."""
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
    """Lines of a Markdown table. `baseline`: stages of an earlier run; may be empty."""
    lines = ["| stage | ms | of its limit | over the earlier run |", "|---|---|---|---|"]
    for name, stage in stages.items():
        part = f"{stage['of_limit']:.0%} of {stage['limit']}" if "limit" in stage else ""
        ratio = f"{stage['seconds'] / baseline[name]['seconds']:.2f}" if name in baseline else ""
        lines.append(f"| {name} | {1e3 * stage['seconds']:.4g} | {part} | {ratio} |")
    return lines


FIXED = ["program", "date", "processor", "peak"]


def history_row(head, stages, best, program, date, processor):
    """The row of a run for a table whose header is `head`; ValueError if that does not begin with the fixed columns."""
    columns = [column.strip() for column in head.strip().strip("|").split("|")]
    if columns[:len(FIXED)] != FIXED:
        raise ValueError(f"expected a table with the columns {', '.join(FIXED)} and names of stages, found: {head}")
    peak = f"{best[ARITHMETIC]['items_per_second'] / 2e9:.0f}" if ARITHMETIC in best else ""
    times = [f"{1e3 * stages[name]['seconds']:.4g}" if name in stages else "" for name in columns[len(FIXED):]]
    return "| " + " | ".join([program, date, processor, peak] + times) + " |"


def with_row(text, make_row):
    """`text` with a row at the end of its only table; make_row(head) gives it."""
    lines = text.rstrip("\n").split("\n")
    table_lines = [i for i, line in enumerate(lines) if line.startswith("|")]
    if len(table_lines) < 2:
        raise ValueError("expected a table")
    lines.insert(table_lines[-1] + 1, make_row(lines[table_lines[0]]))
    return "\n".join(lines) + "\n"


def processor_name():
    """The system's name for it; empty if it has none."""
    try:
        lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return ""
    values = {line.split(":")[0].strip(): line.split(":", 1)[1].strip() for line in lines if ":" in line}
    return ", ".join(part for part in [values.get("model name", ""),
                                       f"family {values['cpu family']}" if "cpu family" in values else ""] if part)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=pathlib.Path, metavar="JSON")
    parser.add_argument("--out", required=True, type=pathlib.Path, help="JSON file of this run")
    parser.add_argument("--baseline", type=pathlib.Path, help="the same of an earlier run")
    parser.add_argument("--history", type=pathlib.Path, help="table of Markdown that gets a row of this run")
    parser.add_argument("--program", default="", help="what was measured, for the JSON file")
    arguments = parser.parse_args()
    results = [json.loads(file.read_text()) for file in arguments.files]
    runs = [run for result in results for run in result["benchmarks"]]
    stages = summarize(runs)
    baseline = {}
    if arguments.baseline:
        baseline = json.loads(arguments.baseline.read_text()).get("stages")
        if baseline is None:
            sys.exit(f"stages.py: {arguments.baseline} holds no stages; expected a file that `make bench` wrote")
    context = results[0]["context"]
    arguments.out.write_text(json.dumps({"program": arguments.program, "date": context["date"],
                                         "processors": context["num_cpus"], "stages": stages}, indent=1) + "\n")
    if arguments.history:
        try:
            text = with_row(arguments.history.read_text(),
                            lambda head: history_row(head, stages, best_runs(runs), arguments.program,
                                                     context["date"][:10], processor_name()))
        except (OSError, ValueError) as error:
            sys.exit(f"stages.py: {arguments.history}: {error}")
        arguments.history.write_text(text)
    print("\n".join(table(stages, baseline)))


if __name__ == "__main__":
    main()
