"""Lines of src/ that the tests ran, from what gcov finds below build/: coverage.py FLOOR [GCOV].

Tells the files below the floor, with the lines not run. Exit code 1 when less than FLOOR percent of all lines ran.
"""
import collections
import glob
import json
import os
import subprocess
import sys


def main():
    floor = float(sys.argv[1])
    gcov = sys.argv[2] if len(sys.argv) > 2 else "gcov"
    ran = collections.defaultdict(lambda: collections.defaultdict(int))
    notes = sorted(glob.glob("build/**/*.gcda", recursive=True))
    for note in notes:
        report = subprocess.run([gcov, "--json-format", "--stdout", note], check=True, capture_output=True, text=True)
        for source in json.loads(report.stdout)["files"]:
            path = os.path.normpath(source["file"])
            if path.startswith("src/"):
                for line in source["lines"]:
                    ran[path][line["line_number"]] += line["count"]
    lines = sum(len(counts) for counts in ran.values())
    run = sum(sum(count > 0 for count in counts.values()) for counts in ran.values())
    for path, counts in sorted(ran.items()):
        share = 100 * sum(count > 0 for count in counts.values()) / len(counts)
        if share < floor:
            print(f"{path}: {share:.1f} %, not run:", *(line for line in sorted(counts) if counts[line] == 0))
    percent = 100 * run / lines if lines else 0.0
    print(f"{run} of {lines} lines of src/ ran: {percent:.1f} %, floor {floor:g} %")
    sys.exit(0 if percent >= floor else 1)


main()
