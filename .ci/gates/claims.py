"""Compares the numbers in README and docstrings with those the suites hold: test/claims.txt, test/frb_claims.f90;
and README's table of speed with the measured one, data/charts/speed.dat.

Exit code 1 and a line for each sentence that is not in its file, number that differs, name without a sentence or
without a suite that uses it.
"""
import glob
import re
import sys

NUMBER = r"([-+]?[0-9]+(?:\.[0-9]+)?(?:[eE][-+]?[0-9]+)?|10\^-?[0-9]+)"


def text_of(path):
    """The text of a file in one line, without comment signs."""
    with open(path, encoding="utf-8") as file:
        return " ".join(re.sub(r"(?m)^\s*(!>|!!|!|#)", " ", file.read()).split())


def value_of(number):
    return 10.0 ** int(number[3:]) if number.startswith("10^") else float(number)


def differences_of_speed():
    """Rows of README's table of speed whose ratios are not those of data/charts/speed.dat, to two decimals."""
    with open("data/charts/speed.dat", encoding="utf-8") as file:
        rows = [[float(word) for word in line.split()] for line in file if not line.startswith("#")]
    # Against Moser-Veselov: flow, momentum only, batches of 1000 and of 1e6.
    measured = {row[0]: [row[4], *row[6:9]] for row in rows}
    with open("README.md", encoding="utf-8") as file:
        told = re.findall(r"(?m)^\| ([0-9.]+)(?: rad)?((?: \| [0-9.]+){4}) \|$", file.read())
    wrong = [] if len(told) >= 4 else ["README.md has no table of speed"]
    for step, ratios in told:
        for ratio, true in zip(ratios.split("|")[1:], measured.get(float(step), [0.0] * 4)):
            if abs(float(ratio) - true) > 0.0051:
                wrong.append(f"README.md says {float(ratio)} at {step} rad, data/charts/speed.dat {true}")
    return wrong


def main():
    wrong = []
    with open("test/frb_claims.f90", encoding="utf-8") as file:
        held = re.findall(r"real\(wp\), parameter :: (\w+) = ([0-9.e+-]+)_wp", file.read())
    held = {name: float(number) for name, number in held}
    told = set()
    with open("test/claims.txt", encoding="utf-8") as file:
        claims = [line.strip() for line in file if line.strip() and not line.startswith("#")]
    for claim in claims:
        path, words = claim.split(": ", 1)
        names = re.findall(r"\{(\w+)\}", words)
        told.update(names)
        pattern = NUMBER.join(re.escape(piece) for piece in re.split(r"\{\w+\}", " ".join(words.split())))
        found = re.search(r"(?<!\w)" + pattern, text_of(path))
        if not names or not set(names) <= set(held):
            wrong.append(f"test/claims.txt: no name, or an unknown one, in: {claim}")
        elif not found:
            wrong.append(f"{path} does not say: {words}")
        else:
            for name, number in zip(names, found.groups()):
                if value_of(number) != held[name]:
                    wrong.append(f"{path} says {number} for {name}, which is {held[name]:g} in: {found.group(0)}")
    suites = "".join(text_of(path) for path in sorted(glob.glob("test/frb_test_*.f90")))
    for name in held:
        if name not in told:
            wrong.append(f"test/claims.txt has no sentence with {name}")
        if not re.search(rf"\b{name}\b", suites):
            wrong.append(f"no suite uses {name} of test/frb_claims.f90")
    wrong += differences_of_speed()
    print(*wrong, sep="\n")
    print(f"{len(claims)} sentences, {len(held)} numbers, {len(wrong)} wrong")
    sys.exit(1 if wrong or not claims or not held else 0)


main()
