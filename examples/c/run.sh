#!/bin/sh
# Builds and runs the C and C++ hosts in a folder of their own, below cargo's target directory.
set -eu
cd "$(dirname "$0")/../.."
folder=${CARGO_TARGET_DIR:-target}/c-hosts
profile=${1:-release}
sh packaging/install.sh "$folder" "$profile"
folder=$(cd "$folder" && pwd)
flags="-Wall -Wextra -Werror -O1 -g -I$folder/include"
link="-L$folder/lib -Wl,-rpath,$folder/lib -lovercoat"
${CC:-cc} -std=c99 -pedantic $flags examples/c/host.c -o "$folder/host_c" $link
${CXX:-c++} -std=c++17 -pedantic $flags examples/c/host.cpp -o "$folder/host_cpp" $link
"$folder/host_c"
"$folder/host_cpp"
