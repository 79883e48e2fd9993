#!/usr/bin/env bash
# tests/package/run.sh STEP BUILD SOURCE   checks the results of `cmake --install` and `cpack` of a build; ctest runs the steps.
set -euo pipefail
# The system's Python, for which the module is built.
export PATH=/usr/bin:/bin:$PATH

step=$1 build=$2 source=$3
work=$build/package_test
prefix=$work/prefix
python_path=$prefix/lib/python3/dist-packages
capture=$work/eggs.glb

fail() {
  echo "$step: $*" >&2
  exit 1
}

# Counters of the same frame by the program, as "name value" lines.
program_counters() { # PROGRAM
  "$1" replay "$capture" --size 160x90 --gpu small --set tile.width=32 --set shading.rate=sample --quiet --no-report --out "$work/out"
  python3 -c 'import json, sys
for name, value in json.load(open(sys.argv[1]))["frames"][0]["counters"].items(): print(name, value)' "$work/out/stats.json"
}

# Nothing below a folder names the source tree.
check_no_source_path() { # FOLDER
  ! grep -rlF "$source/" "$1" >&2 || fail "these files name the source tree"
}

# The manual page and the completions of bash and zsh are where these look for them, and work; each schema is there.
check_shells() { # FOLDER that is /usr or a prefix
  local share=$1/share page name
  for name in $("$1/bin/tessera" describe schema); do
    "$1/bin/tessera" describe schema "$name" | cmp - "$share/tessera/schemas/$name.schema.json" || fail "no schema of $name"
  done
  for file in man/man1/tessera.1 bash-completion/completions/tessera zsh/vendor-completions/_tessera; do
    [ -s "$share/$file" ] || fail "no $file in $share"
  done
  if command -v man >/dev/null; then
    [ "$(man -M "$share/man" -w tessera)" = "$share/man/man1/tessera.1" ] || fail "man does not find its page"
    page=$(LC_ALL=C MANWIDTH=80 man --warnings -l "$share/man/man1/tessera.1" 2>"$work/man.txt") || fail "man cannot render its page"
    [ ! -s "$work/man.txt" ] || { cat "$work/man.txt" >&2; fail "man warns of its page"; }
    for word in NAME "tessera replay" --camera; do grep -qF -- "$word" <<<"$page" || fail "the manual page lacks '$word'"; done
  fi
  # bash-completion loads the file of share/bash-completion/completions that is named as the command.
  bash --norc --noprofile -c 'source "$1" && complete -p tessera' bash "$share/bash-completion/completions/tessera" | grep -q ' tessera$' ||
    fail "bash does not load its completion"
  if command -v zsh >/dev/null; then
    [ "$(zsh -f -c 'fpath=($1/zsh/vendor-completions $fpath); autoload -Uz compinit && compinit -u -D; print $_comps[tessera]' zsh "$share")" = _tessera ] ||
      fail "zsh does not find its completion"
    # As packaged: a folder that Debian's zsh looks at.
    [ ! -e /etc/debian_version ] || zsh -f -c 'print -l $fpath' | grep -qx /usr/share/zsh/vendor-completions || fail "zsh looks elsewhere"
  fi
}

case $step in
install)
  rm -rf "$work"
  mkdir -p "$work"
  cp "$source/captures/eggs.glb" "$capture"
  # As the README has it, where ./tessera has built the program alone.
  rm -f "$build"/lib/libtessera.so*
  grep -qF '`cmake --install build/release`' "$source/README.md" || fail "the README installs otherwise"
  cmake --install "$build" --prefix "$prefix" >"$work/install.log" || fail "see $work/install.log"
  check_no_source_path "$prefix"
  check_shells "$prefix"
  program_counters "$prefix/bin/tessera" >"$work/expected.txt"
  [ "$(wc -l <"$work/expected.txt")" -gt 50 ] || fail "few counters"
  ;;
consumer)
  rm -rf "$work/consumer"
  mkdir -p "$work/consumer"
  cp "$source"/tests/package/consumer/* "$work/consumer"
  [ "$(wc -l <"$work/consumer/main.cpp")" -le 25 ] || fail "the example is long"
  cmake -S "$work/consumer" -B "$work/consumer/build" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_CXX_FLAGS="-Wall -Wextra -Werror" >"$work/consumer.log"
  cmake --build "$work/consumer/build" >>"$work/consumer.log"
  "$work/consumer/build/consumer" "$capture" | diff - "$work/expected.txt" || fail "other counters than the program's"
  if "$work/consumer/build/consumer" "$work/missing.glb" 2>"$work/errors.txt"; then fail "a missing file is read"; fi
  grep -q 'missing.glb' "$work/errors.txt" || fail "the message does not name the missing file"
  ;;
interface)
  # Public names only, in namespace tessera itself: rooms have names in lower case.
  library=$(find "$prefix/lib" -name 'libtessera.so')
  symbols=$(nm -DC --defined-only "$library" | cut -d' ' -f3-)
  grep -q '^tessera::Device::render' <<<"$symbols" || fail "the library shows no Device"
  ! grep -vE "^((typeinfo (name )?|vtable )for )?tessera::([A-Z][A-Za-z]*(::[^C]|$)|version|simd_target|counter_descriptions|drawable_cost_descriptions)" <<<"$symbols" ||
    fail "the library shows these, too"
  # The standard library's headers and our own.
  ! grep -rhE '^ *#include' "$prefix/include" | grep -vE '<(tessera/[a-z]+\.h|[a-z_]+)>' || fail "public headers include these, too"
  ;;
python)
  [ "$(wc -l <"$source/tests/package/counters.py")" -le 20 ] || fail "the example is long"
  PYTHONPATH=$python_path python3 "$source/tests/package/counters.py" "$capture" | diff - "$work/expected.txt" || fail "other counters than the program's"
  ;;
module) PYTHONPATH=$python_path python3 "$source/tests/package/module_test.py" "$capture" "$prefix/bin/tessera" ;;
stubs)
  PYTHONPATH=$python_path python3 -P "$source/python/make_stubs.py" | diff - "$source/python/tessera/__init__.pyi" ||
    fail "run: PYTHONPATH=build/release/python python3 -P python/make_stubs.py > python/tessera/__init__.pyi"
  ;;
debian)
  rm -rf "$work/debian"
  mkdir -p "$work/debian"
  (cd "$work/debian" && cpack -G DEB --config "$build/CPackConfig.cmake" -B "$work/debian" >cpack.log) || { cat "$work/debian/cpack.log"; fail "cpack"; }
  package=$(find "$work/debian" -maxdepth 1 -name '*.deb')
  dpkg-deb -f "$package" Depends | grep -q libtbb12 || fail "no dependency on TBB"
  dpkg-deb -x "$package" "$work/debian/unpacked"
  check_no_source_path "$work/debian/unpacked"
  check_shells "$work/debian/unpacked/usr"
  PATH=/usr/bin:/bin program_counters "$work/debian/unpacked/usr/bin/tessera" | diff - "$work/expected.txt"
  "$work/debian/unpacked/usr/bin/tessera" replay "$capture" --size 160x90 --quiet --out "$work/debian/out"
  [ ! -e /usr/share/javascript/vega ] || grep -q '<html' "$work/debian/out/report.html" || fail "no report"
  for file in usr/include/tessera/device.h usr/lib/*/libtessera.so usr/lib/*/cmake/tessera/tesseraConfig.cmake; do
    compgen -G "$work/debian/unpacked/$file" >/dev/null || fail "the package lacks $file"
  done
  ;;
*) fail "unknown step" ;;
esac
