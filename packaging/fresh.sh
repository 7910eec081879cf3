#!/usr/bin/env bash
# What somebody finds who has never seen this repository: a clone in an empty home, an empty cache of crates, and the
# commands of the README, word for word. The toolchain is the one on the PATH.
#
#     packaging/fresh.sh           every command that stands on a line of its own there
#     packaging/fresh.sh 3         only the first three
#
# Takes as long as building everything twice.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
most=${1:-1000}
home=$(mktemp -d)
trap 'rm -rf "$home"' EXIT
rustup_home=${RUSTUP_HOME:-$HOME/.rustup}
toolchain=$(dirname "$(command -v cargo)")

git clone -q "$here" "$home/overcoat"
cd "$home/overcoat"
# Nothing of the caller's: neither caches nor settings. What the README installs is found as a user's shell finds it.
clean() {
    env -i HOME="$home" CARGO_HOME="$home/.cargo" RUSTUP_HOME="$rustup_home" LANG=C.UTF-8 \
        PATH="$home/.cargo/bin:$toolchain:/usr/local/bin:/usr/bin:/bin" "$@"
}

count=0
while IFS= read -r command; do
    [ "$count" -lt "$most" ] || break
    # A page that waits for a browser is only started.
    case $command in
    *" -- studio"*) command="timeout 20 $command --no-open || [ \$? = 124 ]" ;;
    pip*) command="python3 -m venv \$HOME/python && . \$HOME/python/bin/activate && $command" ;;
    esac
    printf '\n== %s\n' "$command"
    start=$SECONDS
    clean bash -euo pipefail -c "$command" || { echo "FAILED: $command"; exit 1; }
    echo "-- $((SECONDS - start)) s"
    count=$((count + 1))
done < <(grep -E '^    (cargo|sh|pip) ' README.md | sed 's/^    //')

[ "$count" -gt 0 ] || { echo "the README has no commands"; exit 1; }
echo "$count commands of the README work"
