#!/usr/bin/env bash
# Installs what the build, the tools and the tests need on Debian 12; does nothing when it is there.
#
#   tools/install_dependencies.sh          # build and run
#   tools/install_dependencies.sh --studio # also what the studio is built with
#   tools/install_dependencies.sh --test   # also what tools/test.sh needs
#   tools/install_dependencies.sh --all    # also what tools/test.sh --all needs
set -euo pipefail

packages=(g++ cmake ninja-build ccache pkg-config libeigen3-dev libdlib-dev libsvm-dev libssl-dev
          libcairo2-dev libtinygltf-dev nlohmann-json3-dev libcli11-dev libfmt-dev fonts-dejavu-core)
[[ "${1:-}" == --test || "${1:-}" == --all ]] && packages+=(libgtest-dev libgmock-dev python3 python3-numpy python3-jsonschema libxml2-utils)
# The studio: its server, its pages, and the browser in which they are tested.
if [[ -n "${1:-}" ]]; then
  packages+=(libboost-dev)
  command -v npm >/dev/null || packages+=(nodejs npm)
fi
[[ "${1:-}" == --test || "${1:-}" == --all ]] && packages+=(chromium)
[[ "${1:-}" == --all ]] && packages+=(clang clang-format clang-tidy libclang-rt-14-dev libbenchmark-dev)
# What tests/*/reference_values.py and tests/studies compare with.
[[ "${1:-}" == --all ]] && packages+=(python3-sklearn)
# Other people's programs for tests/interop; Blender's glTF importer needs numpy, which its package does not name.
[[ "${1:-}" == --all ]] && packages+=(blender python3-numpy libassimp-dev)

missing=()
for package in "${packages[@]}"; do
  [[ "$(dpkg-query -W -f '${Status}' "$package" 2>/dev/null)" == "install ok installed" ]] || missing+=("$package")
done
((${#missing[@]})) || exit 0

if ! command -v apt-get >/dev/null; then
  echo "These Debian packages are missing and there is no apt-get to install them: ${missing[*]}" >&2
  exit 1
fi
as_root=()
((EUID == 0)) || as_root=(sudo)
echo "Installing ${missing[*]}" >&2
"${as_root[@]}" apt-get update -qq
DEBIAN_FRONTEND=noninteractive "${as_root[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
