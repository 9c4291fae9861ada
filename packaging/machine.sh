# Sets what differs between the machines that wheels are for, by MACHINE; sourced by the scripts
# beside it.
# shellcheck disable=SC2034  # used where this is sourced
case ${MACHINE:=x86_64} in
x86_64)
    cross=
    sysroot=
    ;;
aarch64)
    cross=aarch64-linux-gnu-
    # Debian's packages of arm64, beside what the cross compiler has.
    sysroot=/opt/aarch64
    ;;
*)
    echo "MACHINE is x86_64 or aarch64, not $MACHINE" >&2
    exit 2
    ;;
esac
export NM="${cross}nm"  # of packaging/sbom.py
