#!/bin/sh
# The table of peers: usage: run.sh [ARGUMENTS OF peers], from the root of the repository. Fetches what pip can, builds what there
# are headers for, and measures; what is missing is a line of the table.
set -eu
where=${CARGO_TARGET_DIR:-target}/peers
mkdir -p "$where"
build=$(cd "$where" && pwd)
[ -x "$build/venv/bin/python" ] || python3 -m venv "$build/venv"
"$build/venv/bin/pip" install --quiet -r benches/peers/requirements.txt || echo "no packages of Python: without them" >&2
# AMGCL's headers come with the sources of its Python module, which is not built.
if [ -z "$(find "$build" -maxdepth 1 -name 'pyamgcl-*' -type d)" ]; then
    "$build/venv/bin/pip" download --quiet --no-deps --no-binary :all: -d "$build" pyamgcl==1.0.0.post4 &&
        tar xzf "$build"/pyamgcl-*.tar.gz -C "$build" || echo "no AMGCL: without it" >&2
fi
make --keep-going -C benches/peers OUT="$build" || true
exec cargo run --release --locked --manifest-path experiments/Cargo.toml --features peers --example peers -- \
    --build "$where" --python "$where/venv/bin/python" "$@"
