# Faults of the system: calls that fail, full disks, signals, kills, two builds at once: faults.sh BUILD
# SPC_FAULTS=full tries all of them (make soak); SPC_SEED=N chooses other moments.
[ -n "${TMPDIR:-}" ] || [ ! -w /dev/shm ] || export TMPDIR=/dev/shm      # thousands of small files
. tests/cli/shared/begin.sh
case $tools in
*asan | *tsan)
    echo "skipped: the library before libc and a sanitizer do not go together"
    exit 0
    ;;
esac
full=${SPC_FAULTS:-fast}
seed=${SPC_SEED:-1}
quiet() { "$@" >/dev/null 2>&1; }

# a name that is not ASCII: without memory it must not become another one
quiet "$tools/gen-scan" --triangles 600 --shape statue --color -o "$folder/scan.ply"
quiet "$tools/spc-build" --threads 1 --part-faces 300 --cluster-nodes 256 --block-nodes 64 \
    "$folder/scan.ply" -o "$folder/in.spc"
cp "$folder/in.spc" "$folder/lost.spc"
printf '\377' | dd of="$folder/lost.spc" bs=1 seek=15000 conv=notrunc 2>/dev/null
for share in 0 1; do
    mkdir "$folder/$share"
    cp "$folder/in.spc" "$folder/lost.spc" "$folder/$share"
    cp "$folder/scan.ply" "$folder/$share/$(printf 'sc\303\244n.ply')"
    "$tools/tests/faults_sweep" "$tools" "$folder/$share" "$full" $share 2 >"$folder/said$share" &
    eval "sweep$share=\$!"
done
failed=0
wait "$sweep0" || failed=1
wait "$sweep1" || failed=1
cat "$folder/said0" "$folder/said1"
[ $failed -eq 0 ] || fail "faults are not survived"

mkdir "$folder/stops"
mv "$folder/scan.ply" "$folder/stops"
quiet "$tools/gen-scan" --triangles 30000 --shape statue -o "$folder/stops/large.ply"
if [ "$full" = fast ]; then
    ln "$folder/stops/large.ply" "$folder/stops/huge.ply"
else
    quiet "$tools/gen-scan" --triangles 600000 --shape statue -o "$folder/stops/huge.ply"
fi
"$tools/tests/faults_stops" "$tools" "$folder/stops" "$full" "$seed"

# a disk that cannot read the second half: --recover goes on behind it, and what it builds is whole
head -c 4096 /dev/zero >"$folder/report"
broken() { env FAULTS_BUS=1 FAULTS_REPORT="$folder/report" LD_PRELOAD="$tools/tests/faults_inject.so" "$@"; }
expect 1 "spc-info: '.*/in.spc': part of it cannot be read: the disk fails, or it was cut short" \
    broken "$tools/spc-info" --verify "$folder/in.spc"
expect 1 "spc-info: '.*/in.spc': warning: part of it cannot be read: .*" \
    broken "$tools/spc-info" --recover "$folder/half.spc" "$folder/in.spc"
one_line
grep -q 'with loss' "$folder/out" || fail "recovery from a failing disk does not say what it lost"
expect 0 '' "$tools/spc-info" --verify "$folder/half.spc"

# a limit on the size of files is an error, no death by a signal
expect 1 "spc-build: '.*/big.spc': cannot write .*: File too large; files of that size are not allowed here.*" \
    sh -c "ulimit -f 100; exec $tools/spc-build -q $folder/stops/large.ply -o $folder/big.spc"
one_line
[ -z "$(find "$folder" -maxdepth 1 -name '*big*' -o -maxdepth 1 -name '.spc*')" ] || fail "a limit leaves something"
# what is to go on when the terminal is closed goes on
expect 0 '' sh -c "trap '' HUP; $tools/spc-build -q $folder/stops/large.ply -o $folder/big.spc & sleep 0.05; kill -HUP \$!; wait \$!"
