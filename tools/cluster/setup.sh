#!/bin/sh
# Installs what tools/cluster/run.py needs: setup.sh FOLDER PYTHON. With apt: Slurm, MUNGE and
# OpenSSH. Into FOLDER/python, on top of the environment of PYTHON: Ray, and what Dask needs for
# Slurm and SSH.
set -eu

if ! command -v slurmctld slurmd sbatch munged sshd >/dev/null; then
    if [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null; then
        echo "install Slurm, MUNGE and an SSH server (Debian: slurm-wlm munge openssh-server)" >&2
        exit 1
    fi
    # Debian starts services when they are installed, unless this runlevel is named.
    export DEBIAN_FRONTEND=noninteractive RUNLEVEL=1
    apt-get update -qq
    apt-get install -qq -y --no-install-recommends slurm-wlm munge openssh-server >/dev/null
fi

packages='import sysconfig; print(sysconfig.get_path("purelib"))'
base=$("$2" -c "$packages")
"$2" -m venv "$1/python"
echo "import site; site.addsitedir('$base')" >"$("$1/python/bin/python" -c "$packages")/base.pth"
"$1/python/bin/python" -m pip install --quiet "ray[data] >= 2.60" "dask-jobqueue >= 0.9" \
    "asyncssh >= 2.21"
ln -sf "$(realpath -s "$(dirname "$2")")/vkbloom" "$1/python/bin/vkbloom"
