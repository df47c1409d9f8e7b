#!/usr/bin/env bash
# The page of `bsp2 view` in a real browser: run.sh PROGRAM PAGE WORK [PART]. PAGE is the folder of the page, WORK one for what npm
# fetches; of the test all or a part is done.
# Exit code 77: what it needs is not there. BSP2_SCREENSHOTS=DIR keeps pictures to be looked at.
set -euo pipefail
program=$1 page=$2 work=$3
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

skip() {
  printf 'Skipped: %s\n' "$1"
  exit 77
}

[[ -f $page/view.js ]] || skip "the page was not made, see web/build_page.cmake"
if ! command -v node >/dev/null || ! command -v npm >/dev/null; then skip "npm is missing (Debian: apt-get install npm)"; fi
browser=$(command -v chromium || command -v chromium-browser || command -v google-chrome || true)
[[ -n $browser ]] || skip "there is no chromium (Debian: apt-get install chromium)"

mkdir -p "$work"
if ! cmp -s "$here/package-lock.json" "$work/package-lock.json" || [[ ! -d $work/node_modules/playwright-core ]]; then
  cp "$here/package.json" "$here/.npmrc" "$work/"
  cp "$here/package-lock.json" "$work/wanted.json"
  (cd "$work" && cp wanted.json package-lock.json && npm ci --ignore-scripts --fetch-retries=1 --fetch-timeout=20000 >npm.log 2>&1) || {
    rm -f "$work/package-lock.json"
    skip "npm could not fetch playwright-core, see $work/npm.log"
  }
fi
cp "$here/view_test.mjs" "$work/"
exec node "$work/view_test.mjs" "$program" "$browser" "${@:4}"
