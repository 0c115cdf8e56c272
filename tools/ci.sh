#!/usr/bin/env bash
# The checks of a change, by name; without a name all of them. Installs what it lacks.
#
#   tools/ci.sh              everything, some of it side by side (an hour at most on two cores, from a clean clone)
#   tools/ci.sh fmt clippy   some
#   tools/ci.sh quick        fmt, clippy, pages, and the unit tests of the crates that changed (four minutes after a build)
#   tools/ci.sh --list       their names
set -euo pipefail
cd "$(dirname "$0")/.."

before_test=(fmt clippy doc pages)
# Of all jobs, `test` waits most: for browsers, and for runs that are to be killed. These go on beside it. They build nothing that it builds.
beside_test=(viewer npm core-embedded format-doc package link-gate digests reader fuzz firmware boards c)
after_test=(demo python many-runs)
jobs=("${before_test[@]}" test "${beside_test[@]}" "${after_test[@]}")

embedded_target=thumbv7em-none-eabihf
defmt_print_version=1.2.0
flip_link_version=0.1.12
axe_core_version=4.14.1
npm_tools=(typescript@5.9.3 vite@6.4.6)
python_tools=(maturin==1.16.0 mypy==2.4.1 numpy==2.4.6 nbclient==0.11.0 nbformat==5.11.1 ipykernel==7.4.0)
# One folder for everything that is built, so that a clean-up is one `rm`; the bare-metal workspaces build below it.
target=${CARGO_TARGET_DIR:-$PWD/target}
case $target in /*) ;; *) target=$PWD/$target ;; esac
embedded=$target/embedded
export CARGO_TARGET_DIR=$target
# Flags meant for this machine's CPU would reach the microcontroller's builds too.
unset RUSTFLAGS CARGO_ENCODED_RUSTFLAGS
# Everything is built once: what a second build would need takes a third of the disk.
export CARGO_INCREMENTAL=0
export CARGO_TERM_COLOR=${CARGO_TERM_COLOR:-never}
export PATH="$target/tools/bin:${CARGO_HOME:-${HOME:-}/.cargo}/bin:$PATH"

fail() {
  echo "ci: $*" >&2
  exit 1
}

# --- What a job needs ------------------------------------------------------------------------------------------------

# Debian packages, when the command they bring is missing.
need_command() { # COMMAND PACKAGE…
  local command=$1 as_root=() log
  shift
  command -v "$command" >/dev/null && return
  command -v apt-get >/dev/null || fail "$command is missing: install it (Debian: apt-get install $*)"
  if [ "$(id -u)" -ne 0 ]; then
    sudo -n true 2>/dev/null || fail "$command is missing: run \`sudo apt-get install $*\`"
    as_root=(sudo -n)
  fi
  echo "ci: $command is missing; installing $*"
  # One after the other, where two jobs want something.
  mkdir -p "$target"
  log=$(flock "$target/apt.lock" "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive sh -c 'apt-get update && apt-get install -y --no-install-recommends "$@"' \
    sh "$@" 2>&1) || fail "$command is missing and \`apt-get install $*\` failed: ${log##*$'\n'}"
}

# A driver of Vulkan that computes on the CPU, so that kernels are tested where no GPU is.
need_lavapipe() {
  local driver
  for driver in /usr/share/vulkan/icd.d/lvp_icd.*; do
    [ -e "$driver" ] && return
  done
  # The name is of no command.
  need_command lavapipe mesa-vulkan-drivers
}

# Prints the path of axe.min.js, which checks pages for accessibility; nothing, aloud, where npm has it not.
axe_core() {
  local folder=$target/tools/axe-core
  local file=$folder/node_modules/axe-core/axe.min.js
  [ -e "$file" ] || npm install --silent --no-fund --no-audit --prefix "$folder" "axe-core@$axe_core_version" >&2 ||
    echo "ci: SKIPPED: npm did not install axe-core $axe_core_version, so pages are not checked for accessibility" >&2
  [ ! -e "$file" ] || echo "$file"
}

need_cargo() {
  command -v cargo >/dev/null || fail "cargo is missing: install rustup from https://rustup.rs, which reads rust-toolchain.toml"
  need_command cc gcc libc6-dev
  cargo fmt --version >/dev/null 2>&1 && cargo clippy --version >/dev/null 2>&1 || rustup component add rustfmt clippy ||
    fail "rustfmt or clippy is missing: run \`rustup component add rustfmt clippy\`"
}

# For a sanitiser; any version does.
need_nightly() {
  cargo +nightly --version >/dev/null 2>&1 || rustup toolchain install nightly --profile minimal --no-self-update >/dev/null 2>&1 ||
    fail "a nightly toolchain is missing: run \`rustup toolchain install nightly --profile minimal\`"
}

need_target() { # TARGET
  [ -d "$(rustc --print sysroot)/lib/rustlib/$1/lib" ] && return
  rustup target add "$1" || fail "the target $1 is missing: run \`rustup target add $1\`"
}

need_embedded_target() {
  need_target "$embedded_target"
}

# Prints the folder of llvm-nm and llvm-size.
llvm_tools() {
  local tools
  tools=$(rustc --print sysroot)/lib/rustlib/$(rustc --print host-tuple)/bin
  [ -x "$tools/llvm-size" ] || rustup component add llvm-tools >&2 || fail "llvm-size is missing: run \`rustup component add llvm-tools\`"
  echo "$tools"
}

# A program from the registry.
need_tool() { # CRATE VERSION
  command -v "$1" >/dev/null && return
  cargo install "$1" --version "$2" --locked --debug --root "$target/tools" --target-dir "$target/tools/build" ||
    fail "$1 is missing: run \`cargo install $1 --version $2 --locked\`"
  rm -rf "$target/tools/build"
}

need_python() {
  need_command python3 python3
  # The name is of no command.
  python3 -c 'import ensurepip' 2>/dev/null || need_command python3-venv python3-venv
}

# One of this repository's programs, of the tests' build: built alone it would want its libraries once more, with other features.
program() { # NAME ARGUMENTS…
  cargo build -q --workspace --bins --tests --locked
  "$target/debug/$1" "${@:2}"
}

# --- Jobs: `job_NAME` runs as NAME once NAME is in `jobs` -----------------------------------------------------------

job_fmt() {
  local manifest
  for manifest in $(git ls-files '*Cargo.toml' | xargs grep -l '^\[workspace\]'); do
    cargo fmt --all --check --manifest-path "$manifest"
  done
}

job_clippy() {
  cargo clippy --workspace --all-targets --locked -- -D warnings
  cargo clippy -p pocketsplat --no-default-features --locked -- -D warnings
}

# Not one of `jobs`: what a small change is judged by before it is committed.
job_quick() {
  local file folder folders=() executable
  job_fmt
  job_clippy
  job_pages
  # Folders of crates with a changed file; those of the last commit where nothing is changed.
  while read -r file; do
    folder=$(dirname "$file")
    while [ "$folder" != . ] && [ ! -f "$folder/Cargo.toml" ]; do folder=$(dirname "$folder"); done
    [ "$folder" = . ] || [[ " ${folders[*]} " = *" $folder "* ]] || folders+=("$folder")
  done < <({ git diff --name-only HEAD && git ls-files --others --exclude-standard; } | grep . || git diff --name-only HEAD~1)
  echo "unit tests of: ${folders[*]:-nothing}"
  # Built as the whole workspace: a part of it would want its libraries once more, with other features.
  while read -r file executable; do
    folder=${file#"$PWD/"} folder=${folder%/Cargo.toml}
    [[ " ${folders[*]} " != *" $folder "* ]] || (cd "$folder" && "$executable" -q)
  done < <(cargo test -q --workspace --lib --bins --locked --no-run --message-format=json |
    sed -n 's/.*"manifest_path":"\([^"]*\)".*"executable":"\([^"]*\)".*/\1 \2/p')
}

# Figures of README and pages are those of their CSVs, guides hold none besides, and every link leads somewhere.
job_pages() {
  program figures check
}

job_doc() {
  RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked
  RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked --document-private-items
}

job_test() {
  # Pages are opened in a browser.
  need_command chromium chromium
  # The web package is used as web developers use it.
  need_command node nodejs
  local axe
  axe=$(axe_core)
  # Files of Gaussians are read by programs that are not ours.
  need_command python3 python3
  need_command dwebp webp
  # Poses of photographs and films are found by programs that are not ours.
  need_command colmap colmap
  need_command ffmpeg ffmpeg
  need_command heif-enc libheif-examples
  # Kernels are compared with the CPU's operations, on whatever adapter there is.
  need_lavapipe
  env ${axe:+POCKETSPLAT_AXE="$axe"} POCKETSPLAT_NEEDS_BROWSER=1 POCKETSPLAT_NEEDS_READERS=1 POCKETSPLAT_NEEDS_GPU=1 POCKETSPLAT_NEEDS_COLMAP=1 \
    cargo test --workspace --locked --no-fail-fast
  # The largest frames where overflow is not checked, as firmware is built; above it was.
  cargo test --release -p pocketsplat-core --lib --locked decoder::tests
  # Refusals of what a decoder is built without.
  cargo test -p pocketsplat-format --no-default-features --lib --locked bundle::features
}

# The viewer's WebAssembly module is what its source builds.
job_viewer() {
  local built=$target/pocketsplat.wasm
  need_target wasm32-unknown-unknown
  cargo clippy -q -p pocketsplat-viewer --target wasm32-unknown-unknown --locked -- -D warnings
  viewer/build.sh "$built"
  cmp "$built" viewer/pocketsplat.wasm ||
    fail "viewer/pocketsplat.wasm is not what its source builds; run \`tools/ci.sh bless-viewer\` and commit it"
}

# The package as users of npm get it: packed, its types checked, bundled.
job_npm() {
  local folder=$target/npm
  need_command npm nodejs npm
  rm -rf "$folder"
  mkdir -p "$folder"
  program pocketsplat view tests/golden/static.psb --package "$folder/package"
  (cd "$folder" && npm pack --silent ./package)
  cp -r viewer/tests/bundled "$folder/user"
  (
    cd "$folder/user"
    echo '{ "name": "user", "private": true, "type": "module" }' >package.json
    npm install --silent --no-fund --no-audit "$folder"/pocketsplat-*.tgz "${npm_tools[@]}"
    npx tsc
    npx vite build --logLevel warn
    ls dist/assets/pocketsplat-*.wasm dist/assets/worker-*.js
  )
}

# Not one of `jobs`, part of `test`: the kernels alone.
job_gpu() {
  need_lavapipe
  POCKETSPLAT_NEEDS_GPU=1 cargo test -p pocketsplat-gpu --lib --locked
  POCKETSPLAT_NEEDS_GPU=1 cargo test -p pocketsplat-trainer --lib --locked gpu
}

# Not one of `jobs`: writes the module that `viewer` compares with.
job_bless-viewer() {
  need_target wasm32-unknown-unknown
  viewer/build.sh viewer/pocketsplat.wasm
}

# Without any cargo feature, with each, with every pair and with all.
job_core-embedded() {
  need_embedded_target
  local all sets=("") i j features
  mapfile -t all < <(sed -n '/^\[features\]/,/^\[d/s/^\([a-z-]*\) = .*/\1/p' decoder-core/Cargo.toml | grep -vx default)
  [ ${#all[@]} -le 6 ] || fail "pocketsplat-core has ${#all[@]} cargo features, six at most: ${all[*]}"
  for ((i = 0; i < ${#all[@]}; i++)); do
    sets+=("${all[i]}")
    for ((j = 0; j < i; j++)); do sets+=("${all[j]},${all[i]}"); done
  done
  sets+=("$(IFS=, && echo "${all[*]}")")
  for features in "${sets[@]}"; do
    echo "-- features: ${features:-none}"
    # decoder-format with it, which the features lead to.
    cargo clippy -q -p pocketsplat-core -p pocketsplat-format --target "$embedded_target" --no-default-features \
      --features "${features:+pocketsplat-core/${features//,/,pocketsplat-core/}}" --locked -- -D warnings
  done
  echo "${#sets[@]} sets of features: none, each, every pair, all"
  # decoder-half has assembly on this target.
  cargo clippy -q -p pocketsplat-half --target "$embedded_target" --locked -- -D warnings
  local said
  need_target i686-unknown-linux-gnu
  need_target i586-unknown-linux-gnu
  cargo check -q -p pocketsplat-core --target i686-unknown-linux-gnu --locked
  said=$(cargo check -q -p pocketsplat-core --target i586-unknown-linux-gnu --locked 2>&1) && fail "x87 is not refused"
  grep -q "on x87" <<<"$said" || fail "x87 is refused for another reason: $said"
  echo "i686 builds, i586 is refused: x87"
}

# The annotated bundle in the format's description is what the writer writes today, and so are the decoder's tables.
job_format-doc() {
  program normal_tables --check
  program hexdump --check
}

# Every crate builds from nothing but what the packages hold, and they hold what a user reads.
job_package() {
  local crate file files crates=(pocketsplat pocketsplat-{core,format,half,files,capture,gaussians,instructions,kernels,metrics,gpu,codec,trainer,baselines,viewer})
  files=$(cargo package -p pocketsplat-core --allow-dirty --locked --list)
  for file in README.md CHANGELOG.md examples/{draw_png.rs,example.psb}; do
    grep -qx "$file" <<<"$files" || fail "the package of pocketsplat-core lacks $file"
  done
  files=$(cargo package -p pocketsplat-format --allow-dirty --locked --list)
  for file in README.md src/bundle/{FORMAT,DRAWING,MANIFEST}.md src/bundle/{normal_tables.bin,example.psb}; do
    grep -qx "$file" <<<"$files" || fail "the package of pocketsplat-format lacks $file"
  done
  for crate in "${crates[@]}"; do
    files=$(cargo package -p "$crate" --allow-dirty --locked --list)
    for file in LICENSE-MIT LICENSE-APACHE; do
      grep -qx "$file" <<<"$files" || fail "the package of $crate lacks $file"
    done
  done
  # Cargo's own verification would build every dependency twice more; a workspace of the unpacked packages, with this one's profiles and lock,
  # takes what `clippy` has checked. Each crate alone: together they would lend each other features.
  local sources=$target/packages/sources
  rm -rf "$target/packages"
  mkdir -p "$sources"
  cargo package --workspace --exclude conformance --exclude tools --exclude pocketsplat-python --allow-dirty --locked --no-verify --target-dir "$target/packages"
  # -m: packed times are of 2006, and to cargo a file that old has been checked.
  for file in "$target"/packages/package/*.crate; do tar -xzmf "$file" -C "$sources"; done
  cp Cargo.lock "$sources"
  {
    echo '[workspace]'
    echo 'members = ["*"]'
    echo 'resolver = "3"'
    sed -n '/^\[profile/,$p' Cargo.toml
    echo '[patch.crates-io]'
    for file in "$sources"/pocketsplat*; do
      crate=${file##*/}
      echo "${crate%-*} = { path = \"$crate\" }"
    done
  } >"$sources/Cargo.toml"
  for crate in "${crates[@]}"; do
    cargo check --manifest-path "$sources/Cargo.toml" -p "$crate" || fail "the package of $crate does not build"
  done
  rm -rf "$target/packages"
  # The oldest Rust that the manifest of pocketsplat-core names, also for the assembly of pocketsplat-half.
  local oldest features
  oldest=$(sed -n 's/^rust-version = "\(.*\)"$/\1/p' decoder-core/Cargo.toml)
  rustup toolchain install "$oldest" --profile minimal --no-self-update >/dev/null 2>&1 || fail "Rust $oldest is missing: run \`rustup toolchain install $oldest\`"
  for features in --all-features --no-default-features; do
    cargo "+$oldest" check -q -p pocketsplat-core --locked --target-dir "$target/oldest" "$features" || fail "pocketsplat-core does not build with Rust $oldest $features"
  done
  rustup "+$oldest" target add "$embedded_target" >/dev/null 2>&1 || fail "Rust $oldest lacks $embedded_target: run \`rustup +$oldest target add $embedded_target\`"
  cargo "+$oldest" check -q -p pocketsplat-half --locked --target-dir "$target/oldest" --target "$embedded_target" || fail "pocketsplat-half does not build with Rust $oldest"
  rm -rf "$target/oldest"
  echo "builds with Rust $oldest"
}

# decoder-core links without an allocator, is at most 1 % larger than in sizes.csv, and reaches no panic but those of a list that
# may only shrink.
job_link-gate() {
  need_embedded_target
  tests/link-gate/build.sh "$(llvm_tools)" "$embedded/link-gate"
}

# Not one of `jobs`: writes the table that `link-gate` compares with.
job_bless-link-gate() {
  need_embedded_target
  tests/link-gate/build.sh "$(llvm_tools)" "$embedded/link-gate" bless
}

# Programs for Linux, with the emulator that runs each and the compiler that links it.
digest_programs=(
  "aarch64-unknown-linux-gnu qemu-aarch64 aarch64-linux-gnu-gcc gcc-aarch64-linux-gnu libc6-dev-arm64-cross"
  "armv7-unknown-linux-gnueabihf qemu-arm arm-linux-gnueabihf-gcc gcc-arm-linux-gnueabihf libc6-dev-armhf-cross"
  "i686-unknown-linux-gnu qemu-i386 i686-linux-gnu-gcc gcc-i686-linux-gnu libc6-dev-i386-cross"
  "s390x-unknown-linux-gnu qemu-s390x s390x-linux-gnu-gcc gcc-s390x-linux-gnu libc6-dev-s390x-cross"
)
# Emulated boards, with the programs without a system that run on each: Cortex-M0+ and M4 code on an M4, M33 code without and with FPU,
# on an M55 too, RISC-V without and with atomics and FPU.
digest_boards=(
  "mps2-an386 thumbv6m-none-eabi thumbv7em-none-eabihf"
  "mps2-an505 thumbv8m.main-none-eabi thumbv8m.main-none-eabihf"
  "mps3-an547 thumbv8m.main-none-eabihf"
  "virt riscv32imc-unknown-none-elf riscv32imac-unknown-none-elf riscv32imafc-unknown-none-elf"
)

# Halves are converted alike on every target, by whatever instructions it has. Three bundles, one of each coder and one of hard cases,
# decode to the same symbols and values and draw the same frames.
job_digests() {
  local out=$target/digests build=$target/digests/build expected found name board emulator compiler packages row names
  need_command qemu-aarch64 qemu-user
  need_command qemu-system-arm qemu-system-arm
  need_command qemu-system-riscv32 qemu-system-misc
  need_command node nodejs
  program digest_bundles "$out"
  # Several targets in one call: each program is one unit of code, which one core compiles.
  build_digests() { # BOARD CARGO_ARGUMENTS…
    (
      cd tests/digest
      export PSB_BOARD=$1 PSB_STATIC=$out/static.psb PSB_CONTEXT=$out/context.psb PSB_HARD=$out/hard.psb
      cargo build -q --locked --target-dir "$build" "${@:2}"
    )
  }
  digest_of() { # NAME RUNNER…
    found=$(timeout 120 "${@:2}" </dev/null) || fail "the digest of $1 failed: $found"
    [ -n "${expected:-}" ] || { expected=$found && echo "$expected"; }
    [ "$found" = "$expected" ] || fail "$1 decodes something else: $found"
    echo "$1: the same"
  }
  build_digests "" --release
  digest_of "this machine, release" "$build/release/digest"
  build_digests ""
  digest_of "this machine, debug" "$build/debug/digest"
  names=(--target wasm32-wasip1)
  need_target wasm32-wasip1
  for row in "${digest_programs[@]}"; do
    read -r name emulator compiler packages <<<"$row"
    need_target "$name"
    # shellcheck disable=SC2086 # several packages
    need_command "$compiler" $packages
    names+=(--target "$name")
  done
  build_digests "" --release "${names[@]}"
  for row in "${digest_programs[@]}"; do
    read -r name emulator _ <<<"$row"
    digest_of "$name" "$emulator" "$build/$name/release/digest"
  done
  # The flag is for the Node.js 18 of Debian 12; later ones need none.
  digest_of wasm32-wasip1 node --no-warnings --experimental-wasi-unstable-preview1 tests/digest/run.mjs "$build/wasm32-wasip1/release/digest.wasm"
  for row in "${digest_boards[@]}"; do
    read -ra names <<<"$row"
    board=${names[0]} names=("${names[@]:1}")
    for name in "${names[@]}"; do need_target "$name"; done
    build_digests "$board" --release "${names[@]/#/--target=}"
    emulator=(qemu-system-arm -M "$board")
    [ "$board" != virt ] || emulator=(qemu-system-riscv32 -M virt -bios none)
    emulator+=(-display none -monitor none -serial none -semihosting-config enable=on,target=native)
    for name in "${names[@]}"; do
      digest_of "$name on $board" "${emulator[@]}" -kernel "$build/$name/release/digest"
    done
  done
}

# A reader written from the documents alone, without the decoder's code, finds in the conformance pack what the decoder finds,
# and draws the golden frames, whose hundreds of splats show the last bits of arithmetic.
job_reader() {
  need_command node nodejs
  node tests/reader/main.mjs check tests/pack
  node tests/reader/main.mjs golden tests/golden
}

# The laws in fuzz/ hold for what libFuzzer makes of the conformance pack in 10 s each; the suite `fuzzing` walks further.
job_fuzz() {
  local name
  need_nightly
  # A C++ compiler builds libFuzzer.
  need_command c++ g++
  for name in parse draw symbols normal; do
    fuzz/run.sh "$name" 10
  done
}

# Boards with the RAM that they get, KiB: as much as such a device has, and so little that anchors are decoded in each frame. Those
# without an FPU draw as firmware without one does.
firmware_runs=("mps2-an386 256" "mps2-an386 76" "mps2-an500 1024" "mps2-an385 76" "virt 76" "virt-fpu 76")
# The same of a bundle whose Gaussians are evaluated once.
baked_runs=("mps2-an386 256" "mps2-an385 256" "virt 256" "virt-fpu 256")

# Every board draws an orbit of a bundle of either coder in its RAM, byte for byte as this machine does, and takes as many
# instructions as it took when docs/results/instructions.csv was written, within 1 % or what the clock resolves, and as are
# predicted, within 10 %.
job_firmware() {
  local measured=$target/firmware/instructions.csv
  measure_firmware "$measured"
  firmware-example/compare.sh docs/results/instructions.csv "$measured" ||
    fail "if that is meant, run \`tools/ci.sh bless-instructions\` and commit its table"
  program fit_instructions "$measured" --bundles "$target/firmware" | tail -1
}

# Not one of `jobs`: writes the table that `firmware` compares with.
job_bless-instructions() {
  # At the end, so that the table stays whole where this is stopped.
  measure_firmware "$target/firmware/blessed.csv"
  cp "$target/firmware/blessed.csv" docs/results/instructions.csv
}

measure_firmware() { # CSV
  local coder run runs options bundle out bytes frame arithmetic orbit
  need_embedded_target
  need_target riscv32imac-unknown-none-elf
  need_target riscv32imafc-unknown-none-elf
  need_target thumbv6m-none-eabi
  need_target thumbv8m.main-none-eabihf
  need_command qemu-system-arm qemu-system-arm
  need_command qemu-system-riscv32 qemu-system-misc
  need_tool defmt-print "$defmt_print_version"
  need_tool flip-link "$flip_link_version"
  mkdir -p "$target/firmware"
  : >"$1"
  for coder in static context matte; do
    bundle=$target/firmware/sample-$coder.psb
    if [ "$coder" = matte ]; then
      runs=("${baked_runs[@]}") options=(--matte)
    else
      runs=("${firmware_runs[@]}") options=(--coder "$coder")
    fi
    program sample_bundle "${options[@]}" "$bundle"
    for run in "${runs[@]}"; do
      out=$target/firmware/$coder-${run/ /-}
      arithmetic=ReferenceArithmetic orbit=()
      case $run in "virt "* | "mps2-an385 "*) arithmetic=WithoutFpu orbit=(--without-fpu) ;; esac
      # shellcheck disable=SC2086 # a board and its RAM
      ARITHMETIC=$arithmetic CARGO_TARGET_DIR=$embedded firmware-example/measure.sh "$bundle" $run "" "$out" >"$out.csv"
      bytes=$(sed -n 's/.*scratch: \([0-9]*\) bytes.*/\1/p' "$out/log.txt")
      program draw_orbit "$bundle" "$out/host" --bytes "$bytes" "${orbit[@]}" >/dev/null
      for frame in "$out"/frame*.ppm; do
        cmp "$frame" "$out/host/${frame##*/}" || fail "a frame of $run KiB differs from this machine's, sample $coder"
      done
      echo "$run KiB, sample $coder: $(ls "$out"/frame*.ppm | wc -l) frames as on this machine; $(sed -n 's/.*\(stack: [0-9]*\).*/\1/p' "$out/log.txt")"
      if [ -s "$1" ]; then sed 1d "$out.csv" >>"$1"; else cat "$out.csv" >"$1"; fi
    done
  done
  (
    cd firmware-example
    export PSB_BUNDLE=$target/firmware/sample-static.psb
    options=(--release --locked --bin two_buffers --features two-buffers --target-dir "$embedded")
    cargo clippy -q "${options[@]}" -- -D warnings
    cargo build -q "${options[@]}"
    ./qemu.sh "$embedded/$embedded_target/release/two_buffers" || fail "two tile buffers do not draw what render draws"
    options=(--release --locked --bin two_cores --features two-cores --target thumbv8m.main-none-eabihf --target-dir "$embedded")
    BOARD=mps2-an521 cargo clippy -q "${options[@]}" -- -D warnings
    options=(--release --locked --bin steps --target-dir "$embedded")
    cargo build -q "${options[@]}"
    ./qemu.sh "$embedded/$embedded_target/release/steps" || fail "a step of a frame takes too long"
    cargo clippy -q "${options[@]}" -- -D warnings
    export PSB_BUNDLE=$bundle
    for out in "$embedded_target" riscv32imac-unknown-none-elf riscv32imafc-unknown-none-elf thumbv6m-none-eabi; do
      cargo clippy -q --release --locked --target "$out" --target-dir "$embedded" -- -D warnings
    done
  )
  # A program of this machine, unlike the others there.
  for check in "test" "clippy --all-targets"; do
    # shellcheck disable=SC2086 # a command and its option
    cargo $check -q --locked --manifest-path firmware-example/cycles/Cargo.toml --target-dir "$target/cycles"
  done
  CARGO_TARGET_DIR=$embedded firmware-example/cycles.sh "$target/firmware/sample-static.psb" 256 >"$target/firmware/cycles.csv"
  [ "$(wc -l <"$target/firmware/cycles.csv")" = 5 ] || fail "cycles.sh counted no four frames"
  CARGO_TARGET_DIR=$embedded firmware-example/two_cores.sh "$target/firmware/sample-static.psb" 520 >"$target/firmware/two-cores.csv" ||
    fail "two cores draw something else than one"
  for frame in "$embedded"/two_cores/frame*.ppm; do
    cmp "$frame" "$target/firmware/static-mps2-an386-256/host/${frame##*/}" || fail "a frame of a Cortex-M33 differs from this machine's"
  done
  awk -F, 'NR > 1 && $NF < 1.7 { slow = 1 } END { exit slow || NR != 5 }' "$target/firmware/two-cores.csv" ||
    fail "a frame of two cores takes more than 1/1.7 of one core's: $(cat "$target/firmware/two-cores.csv")"
}

# Firmware for real boards builds (clippy would build their large HALs once more), and a display of memory gets the pixels of `render`.
job_boards() {
  local bundle=$target/firmware/sample-static.psb board
  need_embedded_target
  need_target thumbv8m.main-none-eabihf
  mkdir -p "$target/firmware"
  [ -s "$bundle" ] || program sample_bundle --coder static "$bundle"
  (cd boards && cargo test -q -p pocketsplat-panel --locked --target-dir "$target/boards")
  for board in pico2 stm32f429i-disco; do
    (cd "boards/$board" && PSB_BUNDLE=$bundle cargo build -q --release --locked --target-dir "$embedded")
    echo "$board builds"
  done
}

# The C interface, on this machine with sanitisers and on a board.
job_c() {
  need_embedded_target
  need_target riscv32imac-unknown-none-elf
  need_command arm-none-eabi-gcc gcc-arm-none-eabi
  need_command qemu-system-arm qemu-system-arm
  decoder-c/test.sh "$target/c"
}

# The main job in small: the same path as `cargo run --release -- demo`, a few hundred steps on small images.
job_demo() {
  program pocketsplat demo --output "$target/demo" --size 64 --iterations 400
}

# The wheel, as a user of Python gets it: small, with the command, and with types; made of the tests' build.
job_python() {
  program pocketsplat --version
  wheel --features as-in-tests
}

wheel() { # OPTIONS_OF_MATURIN…
  local environment=$target/python wheel
  need_python
  [ -x "$environment/bin/maturin" ] || python3 -m venv "$environment"
  "$environment/bin/pip" install -q --disable-pip-version-check "${python_tools[@]}"
  rm -rf "$target/wheels"
  (cd python && "$environment/bin/maturin" build --locked --target-dir "$target" --out "$target/wheels" "$@")
  wheel=$(echo "$target"/wheels/*.whl)
  [ "$(stat -c %s "$wheel")" -le 15000000 ] || fail "the wheel has $(stat -c %s "$wheel") bytes, 15,000,000 are allowed"
  "$environment/bin/pip" install -q --disable-pip-version-check --force-reinstall --no-deps "$wheel"
  (cd python && "$environment/bin/mypy" pocketsplat tests/test_pocketsplat.py)
  # Elsewhere, so that the sources are not taken for the package.
  (cd "$target" && REPOSITORY=$OLDPWD "$environment/bin/python" -m unittest discover "$OLDPWD/python/tests")
  (cd "$target" && "$environment/bin/python" "$OLDPWD/python/tests/run_notebook.py" "$OLDPWD/python/notebook.ipynb")
}

# Not one of `jobs`: the files of a release for this machine's target, in target/release-files. CONTRIBUTING says what becomes of them.
job_release() {
  local version host name files=$target/release-files
  job_npm
  cargo build --release --locked
  wheel --release
  version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml)
  host=$(rustc --print host-tuple)
  # As `cargo binstall` looks for it.
  name=pocketsplat-$host-v$version
  rm -rf "$files"
  mkdir -p "$files/$name"
  cp README.md CHANGELOG.md LICENSE-MIT LICENSE-APACHE "$files/$name"
  # Debugging information is four fifths of it.
  strip -o "$files/$name/pocketsplat" "$target/release/pocketsplat"
  "$target/release/pocketsplat" man "$files/$name/man"
  for shell in bash zsh fish; do "$target/release/pocketsplat" completions $shell >"$files/$name/pocketsplat.$shell"; done
  tar -C "$files" --owner=0 --group=0 -czf "$files/$name.tgz" "$name"
  rm -r "${files:?}/$name"
  cp "$target"/wheels/*.whl "$target"/npm/pocketsplat-*.tgz "$files"
  (cd "$files" && sha256sum -- * >"../SHA256SUMS-$host" && mv "../SHA256SUMS-$host" .)
  ls -l "$files"
}

# A plan of runs, killed at a random moment under either executor, ends in the same tables.
job_many-runs() {
  need_command pkill procps
  need_python
  program pocketsplat --version
  tests/many-runs/test.sh "$target/debug/pocketsplat" "$target/many-runs"
}

# --- Running them ----------------------------------------------------------------------------------------------------

if [ "${1:-}" = --list ]; then
  printf '%s\n' "${jobs[@]}"
  exit
fi
for job in "$@"; do
  declare -F "job_$job" >/dev/null || fail "no job is called $job; there are: ${jobs[*]}"
done

# What a process waited for has taken of all cores, which other work on the machine changes little.
processor_seconds() { # PROCESS
  local fields
  read -ra fields <"/proc/$1/stat"
  echo $(((fields[15] + fields[16]) / $(getconf CLK_TCK)))
}

run() { # JOB…
  local job start processor shell=$BASHPID
  for job in "$@"; do
    echo "== $job"
    start=$SECONDS processor=$(processor_seconds "$shell")
    "job_$job"
    echo "== $job: passed in $((SECONDS - start)) s, $(($(processor_seconds "$shell") - processor)) processor seconds"
  done
}

need_cargo
if [ $# -gt 0 ]; then
  run "$@"
else
  run "${before_test[@]}"
  mkdir -p "$target"
  log=$target/beside-test.log
  # A process group of its own, so that all of it ends where a test fails.
  set -m
  (run "${beside_test[@]}") >"$log" 2>&1 </dev/null &
  beside=$!
  set +m
  trap 'kill -- "-$beside" 2>/dev/null || true; echo "ci: what ran beside the tests said: $log" >&2' EXIT
  run test
  trap - EXIT
  passed=1
  wait "$beside" || passed=
  cat "$log"
  [ -n "$passed" ] || fail "a job beside the tests failed; its words stand above"
  run "${after_test[@]}"
fi
echo "== all passed in $SECONDS s, $(processor_seconds $$) processor seconds: ${*:-${jobs[*]}}"
