"""Compares the numbers in README and docstrings with those the suites hold: test/claims.txt, test/frb_claims.f90.

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
    print(*wrong, sep="\n")
    print(f"{len(claims)} sentences, {len(held)} numbers, {len(wrong)} wrong")
    sys.exit(1 if wrong or not claims or not held else 0)


main()
