#!/bin/sh
# Builds the C library and installs it with its header, a pkg-config file and a CMake package.
#
#     sh packaging/install.sh PREFIX [PROFILE]
#
# PROFILE is a cargo profile, `release` unless given.
set -eu
[ $# -ge 1 ] || { echo "usage: sh packaging/install.sh PREFIX [PROFILE]" >&2; exit 2; }
mkdir -p "$1/include" "$1/lib/pkgconfig" "$1/lib/cmake/overcoat"
prefix=$(cd "$1" && pwd)
profile=${2:-release}
cd "$(dirname "$0")/.."

cargo rustc --quiet --lib --no-default-features --features capi,cloth,microfacet,legacy --profile "$profile" --crate-type cdylib,staticlib

[ "$profile" = dev ] && profile=debug
built=${CARGO_TARGET_DIR:-target}/$profile
case $(uname) in
    Darwin) shared=libovercoat.dylib ;;
    *) shared=libovercoat.so ;;
esac
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
cp include/overcoat.h "$prefix/include/"
cp "$built/$shared" "$built/libovercoat.a" "$prefix/lib/"
fill() { sed -e "s|@PREFIX@|$prefix|" -e "s|@VERSION@|$version|" -e "s|@SHARED@|$shared|" "$1" > "$2"; }
fill packaging/overcoat.pc.in "$prefix/lib/pkgconfig/overcoat.pc"
fill packaging/overcoat-config.cmake.in "$prefix/lib/cmake/overcoat/overcoat-config.cmake"
echo "installed overcoat $version in $prefix"
