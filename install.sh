# What ./demo and ./verify need beyond a Linux machine with rustup, a C linker and Python 3; both source
# this file. Every step says what it installs and does nothing when it is already there.

say() { printf '\033[1m==>\033[0m %s\n' "$*" >&2; }
fail() { printf 'error: %s\n' "$*" >&2; exit 1; }

# Room for what is built, GB: a full disk fails late, and in the name of whatever was writing.
need_disk() {
  local free
  free=$(df -Pk . | awk 'NR == 2 { print int($4 / 1048576) }')
  [ "$free" -ge "$1" ] || fail "$1 GB of free disk are needed here and $free are left; free some and run again"
}

# Packages of the distribution, by name; only Debian and its relatives are known here.
need_packages() {
  local missing=() package
  for package in "$@"; do
    dpkg -s "$package" >/dev/null 2>&1 || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return
  command -v apt-get >/dev/null || fail "this machine has no apt-get; install these yourself and run again: ${missing[*]}"
  local as_root=()
  [ "$(id -u)" -eq 0 ] || as_root=(sudo)
  say "installing with apt-get: ${missing[*]}"
  "${as_root[@]}" apt-get update -qq
  DEBIAN_FRONTEND=noninteractive "${as_root[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
}

# The toolchain of rust-toolchain.toml with its components and the chip's target.
need_rust() {
  command -v rustup >/dev/null || need_packages rustup
  local channel
  channel=$(sed -n 's/^channel = "\(.*\)"/\1/p' rust-toolchain.toml)
  if ! rustup toolchain list | grep -q "^$channel-"; then
    say "installing Rust $channel with rustup (compiler, clippy, rustfmt, llvm-tools)"
    rustup toolchain install "$channel" --profile minimal --component clippy,rustfmt,llvm-tools --no-self-update >/dev/null 2>&1 ||
      fail "rustup could not install $channel; run: rustup toolchain install $channel"
  fi
  local installed
  installed=$(rustup component list --toolchain "$channel" --installed)
  for component in clippy rustfmt llvm-tools; do
    grep -q "^$component" <<<"$installed" || { say "adding $component"; rustup component add --toolchain "$channel" "$component" >/dev/null 2>&1; }
  done
  rustup target list --toolchain "$channel" --installed | grep -q thumbv7em-none-eabihf || {
    say "adding the target thumbv7em-none-eabihf"
    rustup target add --toolchain "$channel" thumbv7em-none-eabihf >/dev/null 2>&1
  }
}

# A virtual environment in .venv with the pinned packages of tests/python/requirements.txt.
need_python() {
  local wanted=tests/python/requirements.txt
  cmp -s "$wanted" .venv/installed.txt && return
  say "installing into .venv: $(grep -v '^#' "$wanted" | tr '\n' ' ')"
  python3 -m venv .venv 2>/dev/null || { need_packages python3-venv; python3 -m venv .venv; }
  .venv/bin/pip install -q --disable-pip-version-check -r "$wanted"
  cp "$wanted" .venv/installed.txt
}

# The release images of both boards, side by side in target/images.
build_images() {
  local board
  mkdir -p target/images
  for board in "$@"; do
    say "building the firmware image for $board"
    cargo build -q -p firmware --bin firmware --release --target thumbv7em-none-eabihf --no-default-features --features "board-$board"
    cp target/thumbv7em-none-eabihf/release/firmware "target/images/$board.elf"
  done
}
