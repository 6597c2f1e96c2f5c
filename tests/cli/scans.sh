# Several scans, batches, lists, folders, pipes, and where a scan lies: scans.sh BUILD
. tests/cli/shared/begin.sh
value() { sed -n "s/.*\"$1\": \([0-9]*\).*/\1/p" "$folder/out" | head -n 1; }
# small SEED FILE [OPTIONS]: a statue of 600 triangles
small() {
    seed=$1
    file=$2
    shift 2
    "$tools/gen-scan" --triangles 600 --seed "$seed" "$@" -o "$file" 2>/dev/null
}
small 1 "$folder/a.ply"
small 2 "$folder/b.ply" --format ascii --double --offset 5,0,0 --color
small 3 "$folder/c.ply"

# one archive of several scans: sums, sources by name, the surface closed as each is
expect 0 '' "$tools/spc-build" -q --json "$folder/a.ply" "$folder/b.ply" -o "$folder/ab.spc"
one=$("$tools/spc-build" -q --json "$folder/a.ply" -o "$folder/a.spc" | sed -n 's/.*"leaves": \([0-9]*\).*/\1/p')
[ "$(value leaves)" -eq $((2 * one)) ] || fail "two scans of $one triangles make $(value leaves)"
grep -q '"closed": true' "$folder/out" || fail "two closed scans are not closed"
expect 0 '' "$tools/spc-info" --verify "$folder/ab.spc"
expect 0 '' "$tools/spc-info" "$folder/ab.spc"
grep -q '^source  *a.ply (ply le)' "$folder/out" && grep -q '^source  *b.ply (ply ascii)' "$folder/out" ||
    fail "sources are not named"
"$tools/spc-build" -q --threads 1 --part-faces 100 "$folder/a.ply" "$folder/b.ply" -o "$folder/ab2.spc"
cmp -s "$folder/ab.spc" "$folder/ab2.spc" || fail "several scans: parts leave a trace"
"$tools/spc-build" -q --vertices-on-disk --slice-log2 7 "$folder/a.ply" "$folder/b.ply" -o "$folder/ab3.spc"
cmp -s "$folder/ab.spc" "$folder/ab3.spc" || fail "several scans: sorted corners leave a trace"

# whichever of them is broken is named, and no archive appears
head -c 9000 "$folder/b.ply" >"$folder/cut.ply"
expect 1 "spc-build: '.*/cut.ply': .*the file ends.*" \
    "$tools/spc-build" "$folder/a.ply" "$folder/cut.ply" "$folder/c.ply" -o "$folder/abc.spc"
[ ! -e "$folder/abc.spc" ] || fail "an archive of a broken scan"
expect 1 "spc-build: '.*/none.ply': cannot open.*" \
    "$tools/spc-build" "$folder/a.ply" "$folder/none.ply" -o "$folder/abc.spc"
expect 1 "spc-build: '.*/b.ply': the target is the scan itself" \
    "$tools/spc-build" --force "$folder/a.ply" "$folder/b.ply" -o "$folder/b.ply"

# a batch: a folder, one of its files broken, one of no scan's name; and two scans of one stem
mkdir "$folder/museum"
small 4 "$folder/museum/one.ply"
small 5 "$folder/museum/two.PLY"
cp "$folder/cut.ply" "$folder/museum/broken.ply"
echo notes >"$folder/museum/notes.txt"
expect 1 "  '.*/broken.ply': .*the file ends.*" "$tools/spc-build" "$folder/museum" --out-dir "$folder/out1"
grep -q '^2 converted, 1 failed; 1 file not named as a scan passed over:$' "$folder/err" || fail "the last lines: $(cat "$folder/err")"
grep -qE '^\[[0-9]/3\] .*one.spc: .* triangles, ' "$folder/err" || fail "no line for one.ply"
[ "$(cd "$folder/out1" && echo *)" = "one.spc two.spc" ] || fail "the batch made $(ls "$folder/out1")"
"$tools/spc-build" -q "$folder/museum/one.ply" -o "$folder/one.spc"
cmp -s "$folder/one.spc" "$folder/out1/one.spc" || fail "a batch makes other archives"
expect 1 '' "$tools/spc-build" -q --json "$folder/museum" --out-dir "$folder/out1"
grep -q '"status": "EXISTS"' "$folder/out" && grep -q '"converted": \[\]' "$folder/out" || fail "batch --json"
expect 1 '.*0 converted, 2 up to date, 1 failed.*' "$tools/spc-build" --update "$folder/museum" --out-dir "$folder/out1"
touch -d '2001-01-01' "$folder/out1/one.spc"
expect 1 '.*1 converted, 1 up to date, 1 failed.*' "$tools/spc-build" --update "$folder/museum" --out-dir "$folder/out1"
cp "$folder/museum/one.ply" "$folder/museum/one.x.ply"
mkdir "$folder/second"
cp "$folder/museum/two.PLY" "$folder/second/one.ply"
expect 1 "spc-build: '.*/second/one.ply': its archive would be called '.*/one.ply.spc', as that of an earlier scan.*" \
    "$tools/spc-build" --force "$folder/museum/one.ply" "$folder/second" "$folder/a.ply" --out-dir "$folder/out2"
[ "$(cd "$folder/out2" && echo *)" = "a.spc one.ply.spc" ] || fail "names that clash: $(ls "$folder/out2")"
mkdir "$folder/empty"
expect 1 "spc-build: '.*/empty': no file in this folder is named .*" \
    "$tools/spc-build" "$folder/empty" "$folder/a.ply" --out-dir "$folder/out3"
[ -e "$folder/out3/a.spc" ] || fail "an empty folder stops a batch"

# a list
printf '# scans\n%s\n\n%s\r\n' "$folder/a.ply" "$folder/c.ply" >"$folder/list"
expect 0 '2 converted, 0 failed' "$tools/spc-build" --list "$folder/list" --out-dir "$folder/out4"
[ "$(cd "$folder/out4" && echo *)" = "a.spc c.spc" ] || fail "a list makes $(ls "$folder/out4")"
expect 0 '' sh -c "'$tools/spc-build' -q --list - -o '$folder/ac.spc' <'$folder/list'"
expect 1 ".*/none': cannot open the list.*" "$tools/spc-build" --list "$folder/none" --out-dir "$folder/out4"

# standard input: a file, a pipe, a named pipe; the same bytes but for the name
expect 0 '' sh -c "'$tools/spc-build' -q - -o '$folder/s1.spc' <'$folder/a.ply'"
expect 0 '' sh -c "cat '$folder/a.ply' | '$tools/spc-build' -q - -o '$folder/s2.spc'"
cmp -s "$folder/s1.spc" "$folder/s2.spc" || fail "a pipe gives other bytes than a file"
mkfifo "$folder/pipe"
cat "$folder/a.ply" >"$folder/pipe" &
expect 0 '' "$tools/spc-build" -q "$folder/pipe" -o "$folder/s3.spc"
wait
"$tools/spc-info" --verify "$folder/s3.spc" >/dev/null || fail "of a named pipe"
expect 1 "spc-build: '-': .*the file ends.*" sh -c "head -c 5000 '$folder/a.ply' | '$tools/spc-build' - -o '$folder/s4.spc'"
expect 1 "spc-build: '-': the file is empty.*" sh -c "printf '' | '$tools/spc-build' - -o '$folder/s4.spc'"
expect 1 "spc-build: '/dev/zero': a device, not a scan" "$tools/spc-build" /dev/zero -o "$folder/s4.spc"

# progress for programs: an object a line, of each scan
expect 0 '' "$tools/spc-build" --progress json --force "$folder/a.ply" "$folder/c.ply" --out-dir "$folder/out4"
grep -q '^{"scan":".*/a.ply","number":1,"of":2,"phase":"read vertices","done":[0-9]*,"total":[0-9]*,"overall":0\.[0-9]*,"seconds":[0-9.]*}$' \
    "$folder/err" || fail "progress: $(cat "$folder/err")"
grep -q '^{"scan":".*/c.ply","number":2,"of":2,"result":"done","seconds":[0-9.]*}$' "$folder/err" ||
    fail "no result: $(cat "$folder/err")"
expect 1 '\{"scan":".*/cut.ply","result":"failed","status":"INPUT_TRUNCATED","error":".*the file ends.*\}' \
    "$tools/spc-build" --progress json "$folder/cut.ply" -o "$folder/x.spc"
expect 0 '' "$tools/spc-build" "$folder/a.ply" --force -o "$folder/a.spc"
grep -q '%' "$folder/err" && fail "progress without a terminal"

# where a scan lies: kept, shown, taken over when the archive is built anew
expect 0 '' "$tools/spc-build" -q --offset 500000,5400000,100.5 --scale 0.001 --up -y --unit m --crs EPSG:25832 \
    "$folder/a.ply" -o "$folder/w.spc"
expect 0 '' "$tools/spc-info" "$folder/w.spc"
grep -q '^world  *EPSG:25832, unit m, up is -y$' "$folder/out" || fail "spc-info says nothing of the world"
grep -q '^world box  *[0-9.]* 5[0-9.]* .* (x 0.001 + 500000 5400000 100.5)$' "$folder/out" || fail "no box in the world"
"$tools/spc-info" --json "$folder/w.spc" | grep -A8 '"coordinates"' >"$folder/want"
"$tools/spc-build" -q --codec raw "$folder/w.spc" -o "$folder/w2.spc"
"$tools/spc-info" --json "$folder/w2.spc" | grep -A8 '"coordinates"' | cmp -s - "$folder/want" || fail "its place is lost"
"$tools/spc-info" "$folder/w.spc" --recover "$folder/w3.spc" >/dev/null
"$tools/spc-info" --json "$folder/w3.spc" | grep -A8 '"coordinates"' | cmp -s - "$folder/want" || fail "recovery loses its place"
for wrong in '--offset 1,2' '--scale 0' '--up w' '--unit furlong' '--crs 25832' '--crs EPSG:0'; do
    # shellcheck disable=SC2086
    expect 2 '.*takes.*|.*does not know.*' "$tools/spc-build" $wrong "$folder/a.ply" -o "$folder/x.spc"
done

# floats that have spent their digits on an offset
small 6 "$folder/far.ply" --offset 500000,5400000,0
expect 0 ".*far.ply': warning: far from the origin its coordinates resolve only 0.5.*" \
    "$tools/spc-build" "$folder/far.ply" -o "$folder/far.spc"
small 6 "$folder/fard.ply" --offset 500000,5400000,0 --double
expect 0 '' "$tools/spc-build" -q "$folder/fard.ply" -o "$folder/fard.spc"
[ ! -s "$folder/err" ] || fail "doubles far away: $(cat "$folder/err")"

# accounts
printf 'ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nelement face 3\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\nnan 0 0\n4 0 1 2 3\n3 0 1 4\n3 0 1 3\n' >"$folder/sum.ply"
expect 0 '  3 faces read \+ 1 by splitting polygons = 3 kept \+ 1 dropped' "$tools/spc-build" "$folder/sum.ply" -o "$folder/sum.spc"
"$tools/spc-info" "$folder/sum.spc" | grep -q '^read  *3 faces + 1 by splitting polygons = 3 leaves + 1 dropped: 0 bad index, 1 not finite, 0 degenerate$' ||
    fail "spc-info accounts otherwise"

expect 2 '.*-o and --out-dir exclude.*' "$tools/spc-build" "$folder/a.ply" -o "$folder/x.spc" --out-dir "$folder"
expect 2 '.*standard input can be read once.*' "$tools/spc-build" - - -o "$folder/x.spc"
expect 2 '.*--update goes with --out-dir.*' "$tools/spc-build" --update "$folder/a.ply" -o "$folder/x.spc"
