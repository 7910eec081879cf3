#!/usr/bin/env python3
"""Makes of the inputs that fuzzing found the few that fuzz/corpus keeps.

    fuzz/keep.py [TARGET…]      after fuzz/run.sh, which built the targets

Greedily: always the input that reaches most of what none of those kept reaches, the shorter one if two reach as much,
until every place in the program that any input reached is reached.
"""

import os
import pathlib
import subprocess
import sys
import tempfile

FUZZ = pathlib.Path(__file__).resolve().parent
BUILT = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", FUZZ / "../target/fuzz")) / "x86_64-unknown-linux-gnu/release"
LONGEST = 2048


def reached(target, folders):
    """By file, which places in the program it reaches."""
    with tempfile.TemporaryDirectory() as scratch:
        notes = pathlib.Path(scratch) / "notes"
        (pathlib.Path(scratch) / "merged").mkdir()
        command = [BUILT / target, "-set_cover_merge=1", f"-merge_control_file={notes}", f"{scratch}/merged", *folders]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        lines = notes.read_text().splitlines()
    count = int(lines[0])
    files = lines[2 : 2 + count]
    places = {}
    for line in lines[2 + count :]:
        kind, index, *rest = line.split()
        if kind == "FT":
            # Eight to a place: how often it was reached, once, twice, … or more than 127 times.
            places[files[int(index)]] = frozenset(int(feature) // 8 for feature in rest)
    return places


def cover(places):
    """The files to keep."""
    left, kept = set().union(*places.values()), []
    while left:
        best = max(places, key=lambda f: (len(places[f] & left), -os.path.getsize(f), f))
        if not places[best] & left:
            break
        left -= places[best]
        kept.append(best)
    return kept


def main():
    for target in sys.argv[1:] or ["parse", "front_end", "trees", "handles", "studio", "light"]:
        corpus = FUZZ / "corpus" / target
        corpus.mkdir(parents=True, exist_ok=True)
        found = FUZZ / "../target/fuzz-corpus" / target
        places = reached(target, [folder for folder in (corpus, found) if folder.is_dir()])
        small = {f: p for f, p in places.items() if os.path.getsize(f) <= LONGEST}
        kept = cover(small)
        contents = {pathlib.Path(f).name: pathlib.Path(f).read_bytes() for f in kept}
        # Written beside and renamed, and only then is the rest dropped: interrupted, it leaves more rather than less.
        for name, bytes_ in contents.items():
            beside = corpus.with_name(f".{name}")
            beside.write_bytes(bytes_)
            beside.replace(corpus / name)
        for file in corpus.iterdir():
            if file.name not in contents:
                file.unlink()
        print(f"{target}: {len(kept)} of {len(places)} inputs, {sum(map(len, contents.values()))} bytes")


main()
