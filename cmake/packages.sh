# Installs the Debian packages that the build needs. Sourced by bsp2-demo and bsp2-test.

bsp2_packages=(
  cmake ninja-build g++ pkg-config
  libopenmpi-dev openmpi-bin libboost-dev libboost-mpi-dev libboost-serialization-dev
  libhdf5-openmpi-dev libvtk9-dev libocct-data-exchange-dev libocct-ocaf-dev libcairo2-dev libpolyclipping-dev libqhull-dev
  libfreetype-dev libharfbuzz-dev libfontconfig-dev fonts-liberation libxml2-dev libzip-dev libpng-dev zlib1g-dev
  libcli11-dev nlohmann-json3-dev libspdlog-dev libxxhash-dev
  libgtest-dev libbenchmark-dev
  pybind11-dev python3-dev python3-numpy
)

# Prints the packages that are not installed, one a line.
missing_packages() {
  local package
  for package in "${bsp2_packages[@]}"; do
    [[ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" == installed ]] || printf '%s\n' "$package"
  done
}

# Runs apt-get as root, waiting for other package managers rather than failing.
as_root_apt() {
  local sudo=()
  if ((EUID != 0)); then sudo=(sudo); fi
  "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=600 -qq "$@"
}

install_packages() {
  local missing
  mapfile -t missing < <(missing_packages)
  if ((${#missing[@]} == 0)); then return 0; fi
  if ((EUID != 0)) && ! command -v sudo >/dev/null; then
    printf 'These packages are missing; install them as root:\n  apt-get install %s\n' "${missing[*]}" >&2
    return 1
  fi
  printf 'Installing %d packages and what they need:\n' "${#missing[@]}"
  printf '%s ' "${missing[@]}" | fold -s -w "${COLUMNS:-80}" && echo
  # The lists of a fresh machine are empty, those of an old one are stale: then, and only then, fetch them.
  as_root_apt install -y --no-install-recommends "${missing[@]}" >/dev/null 2>&1 && return 0
  as_root_apt update
  as_root_apt install -y --no-install-recommends "${missing[@]}" >/dev/null
}

# Configures and builds a preset; further arguments go to the build.
build_preset() {
  local preset=$1
  shift
  if [[ ! -f build/$preset/build.ninja ]]; then
    mkdir -p build
    cmake --preset "$preset" >"build/configure-$preset.log" 2>&1 ||
      { cat "build/configure-$preset.log" >&2; return 1; }
  fi
  cmake --build --preset "$preset" "$@"
}

# As build_preset, on one line: how many of the steps are done. All that the build says is in build/build-<preset>.log, and shown if it fails.
build_on_one_line() {
  local log=build/build-$1.log line tenth shown=-1 steps='^\[([0-9]+)/([0-9]+)\]'
  mkdir -p build
  if build_preset "$@" 2>&1 | tee "$log" | while IFS= read -r line; do
    [[ $line =~ $steps ]] || continue
    tenth=$((10 * BASH_REMATCH[1] / BASH_REMATCH[2]))
    if [[ -t 1 ]]; then
      printf '\rBuilding: %d of %d steps' "${BASH_REMATCH[1]}" "${BASH_REMATCH[2]}"
    elif ((tenth > shown)); then
      printf 'Building: %d of %d steps\n' "${BASH_REMATCH[1]}" "${BASH_REMATCH[2]}"
    fi
    shown=$tenth
  done; then
    if [[ -t 1 ]]; then echo; fi
    return 0
  fi
  echo
  tail -n 40 "$log" >&2
  printf 'The build failed; all that it said is in %s\n' "$log" >&2
  return 1
}
