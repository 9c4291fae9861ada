# Sets mirror and security_mirror, sourced by the scripts beside it: from DEBIAN_MIRROR and
# DEBIAN_SECURITY_MIRROR, else from what this system's apt is configured to use.
apt_site() {
    apt-get indextargets --format '$(SITE)' 'Created-By: Packages' | sort -u | grep "$@" | head -n 1
}
mirror=${DEBIAN_MIRROR:-$(apt_site -v security)}
security_mirror=${DEBIAN_SECURITY_MIRROR:-$(apt_site security || echo "$mirror-security")}
test -n "$mirror" || { echo "DEBIAN_MIRROR is not set, and apt has no sources" >&2; exit 1; }
