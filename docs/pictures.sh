#!/bin/sh
# Makes the pictures of docs/studio.md again, and those that begin the README. Needs a release build's time, and for the page
# chromium, chromium-driver and selenium (`pip install selenium`).
set -eu
cd "$(dirname "$0")/.."
cargo build --release --quiet
overcoat=${CARGO_TARGET_DIR:-target}/release/overcoat
"$overcoat" render examples/velvet.osl --spp 256 -o docs/velvet.png
"$overcoat" render examples/velvet.osl --sweep roughness=0.15,0.25,0.40,0.65,1.0 --size 256 -o docs/roughness.png
"$overcoat" render examples/satin_lining.osl --scene drape --size 320 --spp 256 -o docs/drape.png
"$overcoat" render examples/nested_sheens.osl --scene ball --size 320 --spp 256 -o docs/ball.png
"$overcoat" plot examples/velvet.osl -o docs/plot.svg
"$overcoat" gallery examples -o docs/gallery --size 128 --spp 64
python3 tests/studio_e2e/drive.py "$overcoat" --screenshot docs/studio.png
