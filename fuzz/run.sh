#!/bin/sh
# Runs fuzz targets and tells what came of it, as a table.
#
#     fuzz/run.sh SECONDS [TARGET…]      each that long, all targets if none is named
#
# JOBS=2        so many targets at once
# SANITIZER=address    also finds misused memory; half as fast. Without it: none
# CARGO_TARGET_DIR     where to build; else target/fuzz
#
# Needs a nightly compiler and `cargo install cargo-fuzz`. New inputs go to target/fuzz-corpus, and inputs that fail to
# target/fuzz-artifacts; `fuzz/keep.py` makes of the former what fuzz/corpus keeps.
set -eu
cd "$(dirname "$0")"
seconds=${1:?seconds per target}
shift
[ $# -gt 0 ] || set -- parse front_end trees handles studio light
sanitizer=${SANITIZER:-none}
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/../target/fuzz}"
found=$PWD/../target/fuzz-corpus
failed=$PWD/../target/fuzz-artifacts
mkdir -p "$found" "$failed"

cargo +nightly fuzz build -s "$sanitizer" >"$found/build.log" 2>&1 || { tail -20 "$found/build.log"; exit 1; }
programs=$CARGO_TARGET_DIR/x86_64-unknown-linux-gnu/release

# One target, with the scripts of the tests as seeds where it reads scripts. Goes on after an input that fails, so that
# one fault does not hide the next.
run() {
    target=$1
    mkdir -p "$found/$target" "$failed/$target" "corpus/$target"
    seeds=corpus/$target
    case $target in parse | front_end) seeds="$seeds ../tests/corpus/osl ../tests/corpus/energy ../examples" ;; esac
    # shellcheck disable=SC2086
    "$programs/$target" -max_total_time="$seconds" -fork=1 -ignore_crashes=1 -ignore_timeouts=1 -ignore_ooms=1 \
        -timeout=60 -rss_limit_mb=2500 -max_len=4096 -artifact_prefix="$failed/$target/" \
        "$found/$target" $seeds >"$found/$target.log" 2>&1 || true
}

# The last `name: number` of a log.
last() { grep -o "$2: [0-9]*" "$found/$1.log" | tail -1 | grep -o '[0-9]*$' || echo 0; }

running=0
for target; do
    run "$target" &
    running=$((running + 1))
    if [ "$running" -ge "${JOBS:-1}" ]; then
        wait
        running=0
    fi
done
wait

printf '%-10s %12s %8s %8s %8s %8s\n' target executions cov ft corpus findings
status=0
for target; do
    # In fork mode a line begins with `#executions`.
    executions=$(grep -o '^#[0-9]*' "$found/$target.log" | tail -1 | tr -d '#')
    findings=$(find "$failed/$target" -type f | wc -l)
    [ "$findings" -eq 0 ] || status=1
    printf '%-10s %12s %8s %8s %8s %8s\n' "$target" "${executions:-0}" "$(last "$target" cov)" "$(last "$target" ft)" \
        "$(find "$found/$target" -type f | wc -l)" "$findings"
done
exit $status
