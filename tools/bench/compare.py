#!/usr/bin/env python3
"""Is build B slower than build A, beyond what timings differ by themselves?

  compare.py A.json B.json                              two reports of the same `mote bench NAME --report`
  compare.py --run PATH_A PATH_B -- lighting --count N  runs `PATH bench lighting --count N` of both in turn

For everything that both timed: the ratio B / A of the median seconds, an interval that holds it in 99 of 100 cases
whatever the distribution of the noise, and a verdict. `slower` or `faster` needs an interval that leaves out 1 and a
ratio at least --tolerance from 1: what moves code about in memory alone gives one or two percent.

Two reports were made at two times, and what the machine did in between is in the ratio; more than 5 runs in each do
not help against that. Runs in turn do: the order of a pair alternates (A B, B A, …), so a drift of the machine is on
neither side. Prefer --run.

Exit code: 0 nothing is slower, 1 something is, 2 bad usage, a bad report, or a program that failed.
"""
import argparse
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile

CONFIDENCE = 0.99


class BadInput(Exception):
    """What the user has to mend; main() prints it."""


def sign_rank(pairs):
    """Largest k such that the k-th least and k-th greatest of `pairs` differences enclose their median with
    CONFIDENCE (sign test: how many lie above the median is binomial); 0 if there are too few."""
    tail, k = 0.0, 0
    while k < pairs // 2:
        tail += math.comb(pairs, k) / 2**pairs
        if 2 * tail > 1 - CONFIDENCE:
            break
        k += 1
    return k


def rank_sum_rank(n, m):
    """Largest k such that the k-th least and k-th greatest of the n·m differences between two samples enclose the
    shift with CONFIDENCE (Mann and Whitney's U, counted exactly); 0 if there are too few."""
    # ways[i][u]: how many orders of i of the first sample and j of the second have U = u.
    ways = [[1] + [0] * (n * m) for _ in range(n + 1)]
    for j in range(1, m + 1):
        for i in range(1, n + 1):
            # The greatest value is of the second sample (U as with j − 1) or of the first (it beats all j).
            ways[i] = [ways[i][u] + (ways[i - 1][u - j] if u >= j else 0) for u in range(n * m + 1)]
    total, tail, k = math.comb(n + m, n), 0, 0
    while k < n * m // 2:
        tail += ways[n][k]
        if 2 * tail / total > 1 - CONFIDENCE:
            break
        k += 1
    return k


def interval(ratios, rank):
    """(least, greatest) by rank, or None where there are too few numbers for CONFIDENCE."""
    ordered = sorted(ratios)
    return (ordered[rank - 1], ordered[-rank]) if rank > 0 else None


def compare_pairs(a, b):
    """Timings taken in turn: the median of the pairs' ratios and its interval."""
    ratios = [y / x for x, y in zip(a, b)]
    return statistics.median(ratios), interval(ratios, sign_rank(len(ratios)))


def compare_samples(a, b):
    """Timings of two reports: the median of all ratios (Hodges and Lehmann's estimate) and its interval."""
    ratios = [y / x for x in a for y in b]
    return statistics.median(ratios), interval(ratios, rank_sum_rank(len(a), len(b)))


def verdict(ratio, bounds, tolerance):
    if bounds is None:
        return "too few runs"
    if bounds[0] > 1 and ratio > 1 + tolerance:
        return "slower"
    if bounds[1] < 1 and ratio < 1 / (1 + tolerance):
        return "faster"
    return "no difference"


def timings(report, where, measure):
    """{(benchmark, contender): (count, seconds)}; raises BadInput where the report is none or a check failed."""
    found = {}
    try:
        for run in report["runs"]:
            if not run["check"]["passed"]:
                raise BadInput(f"{where}: {run['name']}: the results are wrong ({run['check']['text']})")
            for side in ("a", "b"):
                seconds = [float(s) for s in run[f"{measure}_{side}"]]
                if any(not s > 0 for s in seconds):
                    raise BadInput(f"{where}: {run['name']}: expected {measure} > 0, got {min(seconds)}")
                if seconds:
                    found[run["name"], run[side]] = run["count"], seconds
    except (KeyError, TypeError, ValueError) as error:
        raise BadInput(f"{where}: expected a report of mote bench --report: {error!r}") from error
    return found


def read_report(path):
    try:
        with open(path, encoding="utf-8") as file:
            return json.load(file)
    except (OSError, ValueError) as error:
        raise BadInput(f"{path}: {error}") from error


def machine_of(report):
    """What makes timings of two reports comparable."""
    return {key: report.get(key) for key in ("benchmark", "threads", "simd", "device")}


def run_once(program, arguments, folder):
    """One report of `program bench …`."""
    path = os.path.join(folder, "report.json")
    try:
        done = subprocess.run([program, "bench", *arguments, "--report", path], check=False, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True)
    except OSError as error:
        raise BadInput(f"{program}: {error}") from error
    if done.returncode != 0:
        raise BadInput(f"{program} bench {' '.join(arguments)}: exit code {done.returncode}\n{done.stdout.rstrip()}")
    return read_report(path)


def run_pairs(programs, arguments, pairs, measure):
    """Both programs' timings, a number a process: the median of its runs."""
    sides = {}, {}
    with tempfile.TemporaryDirectory() as folder:
        for pair in range(pairs):
            for side in (0, 1) if pair % 2 == 0 else (1, 0):
                report = run_once(programs[side], arguments, folder)
                for key, (count, seconds) in timings(report, programs[side], measure).items():
                    sides[side].setdefault(key, (count, []))[1].append(statistics.median(seconds))
            print(f"\rpair {pair + 1} of {pairs}", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return sides


def print_table(a, b, compare, tolerance):
    """Prints a line for each thing that both timed; true if one is slower."""
    if not a.keys() & b.keys():
        raise BadInput("the two have no benchmark in common")
    slower = False
    print(f"{'benchmark: contender':<60} {'A [s]':>9} {'B [s]':>9} {'B / A':>6}  {'99 % interval':<14}  verdict")
    for key in a:
        name = ": ".join(key)
        if key not in b:
            print(f"{name:<60} only in A")
            continue
        (count_a, seconds_a), (count_b, seconds_b) = a[key], b[key]
        if count_a != count_b:
            raise BadInput(f"{name}: expected the same count in both, got {count_a} and {count_b}")
        ratio, bounds = compare(seconds_a, seconds_b)
        found = verdict(ratio, bounds, tolerance)
        slower = slower or found == "slower"
        between = f"{bounds[0]:.3f} .. {bounds[1]:.3f}" if bounds else "–"
        print(f"{name:<60} {statistics.median(seconds_a):>9.4g} {statistics.median(seconds_b):>9.4g} {ratio:>6.3f}"
              f"  {between:<14}  {found}")
    for key in b.keys() - a.keys():
        print(f"{': '.join(key):<60} only in B")
    return slower


def parse(arguments):
    rest = []
    if "--" in arguments:
        cut = arguments.index("--")
        arguments, rest = arguments[:cut], arguments[cut + 1:]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("a", metavar="A", help="report, or with --run the program of the first build")
    parser.add_argument("b", metavar="B", help="report, or with --run the program of the second build")
    parser.add_argument("--run", action="store_true", help="A and B are programs to run; what they run stands after --")
    parser.add_argument("--pairs", type=int, default=10, help="runs of each with --run, at least 8; default %(default)s")
    parser.add_argument("--tolerance", type=float, default=0.02, metavar="T",
                        help="a ratio nearer to 1 is no difference; default %(default)s")
    parser.add_argument("--core", action="store_true",
                        help="compare CPU seconds over all threads instead of wall-clock seconds")
    options = parser.parse_args(arguments)
    if options.run != bool(rest):
        parser.error("--run needs the benchmark and its flags after --, and only --run takes them")
    if options.run and sign_rank(options.pairs) == 0:
        parser.error(f"--pairs: expected at least 8 (fewer cannot give {CONFIDENCE:.0%}), got {options.pairs}")
    if not 0 <= options.tolerance < 1:
        parser.error(f"--tolerance: expected a number from 0 to below 1, got {options.tolerance}")
    return options, rest


def main(arguments):
    options, rest = parse(arguments)
    measure = "core_seconds" if options.core else "seconds"
    try:
        if options.run:
            # One timed run a process is the most pairs for the time.
            flags = rest if "--runs" in rest else [*rest, "--runs", "1"]
            a, b = run_pairs((options.a, options.b), flags, options.pairs, measure)
            return int(print_table(a, b, compare_pairs, options.tolerance))
        reports = read_report(options.a), read_report(options.b)
        a, b = timings(reports[0], options.a, measure), timings(reports[1], options.b, measure)
        if machine_of(reports[0]) != machine_of(reports[1]):
            print(f"The reports are not of one machine: {machine_of(reports[0])} and {machine_of(reports[1])}")
        return int(print_table(a, b, compare_samples, options.tolerance))
    except BadInput as error:
        print(f"compare.py: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
