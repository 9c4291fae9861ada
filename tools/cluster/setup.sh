#!/bin/sh
# Installs what tools/cluster/run.py needs: setup.sh FOLDER PYTHON. With apt: Slurm and MUNGE.
# Into FOLDER/python, on top of the environment of PYTHON: what Dask needs for Slurm.
set -eu

missing=""
for program in slurmctld slurmd sbatch munged; do
    command -v $program >/dev/null || missing="$missing $program"
done
if [ -n "$missing" ]; then
    if [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null; then
        echo "missing:$missing (Debian: slurm-wlm munge)" >&2
        exit 1
    fi
    # Debian starts services when they are installed, unless this program forbids it.
    policy=/usr/sbin/policy-rc.d
    if [ ! -e $policy ]; then
        trap 'rm $policy' EXIT
        printf '#!/bin/sh\nexit 101\n' >$policy
        chmod +x $policy
    fi
    export DEBIAN_FRONTEND=noninteractive
    apt-get update -qq
    apt-get install -qq -y --no-install-recommends slurm-wlm munge >/dev/null
fi

packages='import sysconfig; print(sysconfig.get_path("purelib"))'
base=$("$2" -c "$packages")
"$2" -m venv "$1/python"
echo "import site; site.addsitedir('$base')" >"$("$1/python/bin/python" -c "$packages")/base.pth"
"$1/python/bin/python" -m pip install --quiet "dask-jobqueue >= 0.9"
ln -sf "$(realpath -s "$(dirname "$2")")/vkbloom" "$1/python/bin/vkbloom"
