#!/bin/bash
# Runs a script inside a windowed Blender, with an extension's zip installed, and takes pictures of the screen.
#
#   shot.sh EXTENSION.zip SCRIPT.py OUTPUT.png
#
# The script has a generator `def steps():`; each `yield SECONDS` lets Blender draw and handle events for that long.
# What it may call is in hands.py. OUTPUT.png is the screen at the end; shot("name") writes OUTPUT-name.png.
# Ends with 0 where the script raised nothing.
#
# It needs Xvfb, a window manager (openbox), xdotool, ImageMagick's import, and a Blender with a window.
#   BLENDER       that Blender, default `blender` of PATH
#   BLENDER_ROOT  a folder with a whole system that has all these, entered by chroot: needs root
#   SHOT_SIZE     of the screen, default 1600x900
#   SHOT_SECONDS  before it gives up, default 600
set -u
[ $# -eq 3 ] || { sed -n '2,16s/^# \{0,1\}//p' "$0"; exit 2; }
fail() { echo "shot.sh: $*" >&2; exit 1; }
HERE=$(dirname "$(realpath "$0")")
ROOT=${BLENDER_ROOT:-}; export BLENDER=${BLENDER:-blender} SHOT_SIZE=${SHOT_SIZE:-1600x900}
LIMIT=${SHOT_SECONDS:-600}

if [ -n "$ROOT" ] && [ -z "${SHOT_INSIDE:-}" ]; then
    [ -d "$ROOT/usr" ] || fail "BLENDER_ROOT=$ROOT holds no system"
    [ "$(id -u)" = 0 ] || fail "BLENDER_ROOT needs root; unset it and set BLENDER to use this machine's Blender"
    SHOT_INSIDE=1 exec unshare -m -n -p -f --kill-child bash "$(realpath "$0")" \
        "$(realpath "$1")" "$(realpath "$2")" "$(realpath -m "$3")"
fi
if [ -n "$ROOT" ]; then  # mounts of its own, which end with it
    mount -t tmpfs -o size=2g,mode=1777 tmpfs "$ROOT/tmp" && mount -t proc proc "$ROOT/proc" \
        && mkdir -p "$ROOT/dev/shm" && mount -t tmpfs -o size=1g tmpfs "$ROOT/dev/shm" || fail "cannot mount in $ROOT"
    mkdir -p "$ROOT/tmp/.X11-unix"
    WORK=/tmp/shot; mkdir "$ROOT$WORK"; ENTER="chroot $ROOT"
else
    WORK=$(mktemp -d); trap 'rm -rf "$WORK"' EXIT; ENTER=
fi
for program in "$BLENDER" Xvfb openbox xdotool import; do
    $ENTER sh -c "command -v '$program'" >/dev/null \
        || fail "$program was not found; install it, set BLENDER to a Blender with a window, or BLENDER_ROOT"
done
cp "$1" "$ROOT$WORK/extension.zip" && cp "$2" "$ROOT$WORK/script.py" && cp "$HERE"/{driver,hands}.py "$ROOT$WORK/" || fail "cannot copy"

cat > "$ROOT$WORK/inside.sh" <<'INSIDE'
cd "$1"; LIMIT=$2; mkdir home
export HOME=$1/home XDG_RUNTIME_DIR=$1/home BLENDER_USER_RESOURCES=$1/home SHOT_FOLDER=$1 LC_ALL=C.UTF-8
export LIBGL_ALWAYS_SOFTWARE=1 GALLIUM_DRIVER=llvmpipe
exec 3>display
Xvfb -displayfd 3 -screen 0 ${SHOT_SIZE}x24 +extension GLX -nolisten tcp >xvfb.log 2>&1 & X=$!
for _ in $(seq 100); do [ -s display ] && break; sleep 0.1; done
[ -s display ] || { cat xvfb.log; exit 1; }
export DISPLAY=:$(cat display)
openbox >openbox.log 2>&1 & W=$!
sleep 0.5
"$BLENDER" --factory-startup --offline-mode --window-border -p 0 0 ${SHOT_SIZE%x*} ${SHOT_SIZE#*x} \
    --python driver.py >blender.log 2>&1 & B=$!
for _ in $(seq $((LIMIT * 5))); do [ -e status ] || ! kill -0 $B 2>/dev/null && break; sleep 0.2; done
import -window root end.png
kill $B $W $X 2>/dev/null; sleep 0.3; kill -9 $B 2>/dev/null
true
INSIDE
$ENTER bash "$WORK/inside.sh" "$WORK" "$LIMIT"
mkdir -p "$(dirname "$3")"
cp "$ROOT$WORK/blender.log" "${3%.png}.log"
[ -e "$ROOT$WORK/end.png" ] && cp "$ROOT$WORK/end.png" "$3"
for picture in "$ROOT$WORK"/shot-*.png; do
    [ -e "$picture" ] && cp "$picture" "${3%.png}-$(basename "$picture" | cut -c6-)"
done
STATUS=$(cat "$ROOT$WORK/status" 2>/dev/null || echo "Blender ended, or gave nothing for $LIMIT s")
grep -h '^window: ' "${3%.png}.log"
[ "$STATUS" = ok ] || { tail -n 30 "${3%.png}.log" >&2; fail "$(basename "$2"): $STATUS"; }
