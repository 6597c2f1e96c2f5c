# spc-build and spc-info as a user meets them: build.sh BUILD
. tests/cli/shared/begin.sh
absent() { [ ! -e "$1" ] || fail "$1 was left behind"; }
nothing_else() { # no temporary file stays in the folder
    left=$(find "$folder" -name '*.part' -o -name '.spc*')
    [ -z "$left" ] || fail "left behind: $left"
}
quiet() { "$@" >/dev/null 2>&1; }

scan=$folder/scan.ply
quiet "$tools/gen-scan" --triangles 5000 --shape statue --color -o "$scan"

# a conversion, its summary, its verification
expect 0 '.*5 [0-9]{3} triangles, .* nodes in [0-9]+ clusters?, .*' \
    "$tools/spc-build" "$scan" -o "$folder/a.spc"
expect 0 '' "$tools/spc-info" --verify "$folder/a.spc"
grep -q 'is whole' "$folder/out" || fail "verify does not say so"
expect 0 '' "$tools/spc-info" "$folder/a.spc"
expect 0 '' "$tools/spc-build" -q "$scan" -o "$folder/quiet.spc"
[ ! -s "$folder/err" ] || fail "-q is not quiet"
nothing_else

# what fails says so in one line, exits 1 and leaves no target
expect 1 "spc-build: '.*/none.ply': cannot open.*No such file or directory" \
    "$tools/spc-build" "$folder/none.ply" -o "$folder/b.spc"
one_line
absent "$folder/b.spc"
echo "hello" >"$folder/text.ply"
expect 1 "spc-build: '.*/text.ply': .*" "$tools/spc-build" "$folder/text.ply" -o "$folder/b.spc"
one_line
absent "$folder/b.spc"
head -c 60000 "$scan" >"$folder/cut.ply"
expect 1 "spc-build: '.*/cut.ply': .*the file ends.*" "$tools/spc-build" "$folder/cut.ply" -o "$folder/b.spc"
one_line
absent "$folder/b.spc"
expect 1 "spc-build: '.*/no/b.spc': cannot open the target's folder.*" \
    "$tools/spc-build" "$scan" -o "$folder/no/b.spc"
one_line
mkdir "$folder/dir.spc"
expect 1 "spc-build: '.*/dir.spc': the target is a folder.*" "$tools/spc-build" "$scan" -o "$folder/dir.spc"
if [ "$(id -u)" -ne 0 ]; then
    mkdir "$folder/locked"
    chmod 500 "$folder/locked"
    expect 1 "spc-build: '.*/locked/b.spc': .*Permission denied.*" \
        "$tools/spc-build" "$scan" -o "$folder/locked/b.spc"
    one_line
fi
quiet "$tools/gen-scan" --triangles 100 --shape statue -o "$folder/p.ply"
sed '/^element face/,/^property list/d' "$folder/p.ply" >"$folder/points.ply"
expect 1 "spc-build: '.*/points.ply': it holds points without normals.*" \
    "$tools/spc-build" "$folder/points.ply" -o "$folder/b.spc" --cull back
one_line
absent "$folder/b.spc"
nothing_else

# an existing target is replaced only with --force, and stays when the build fails
cp "$folder/a.spc" "$folder/keep.spc"
expect 1 "spc-build: '.*/keep.spc': the target exists; --force replaces it" \
    "$tools/spc-build" "$scan" -o "$folder/keep.spc"
expect 1 '' "$tools/spc-build" --force "$folder/cut.ply" -o "$folder/keep.spc"
cmp -s "$folder/a.spc" "$folder/keep.spc" || fail "the old archive was touched"
expect 0 '' "$tools/spc-build" --force --codec raw "$scan" -o "$folder/keep.spc"
cmp -s "$folder/a.spc" "$folder/keep.spc" && fail "--force did not replace"
echo stale >"$folder/keep.spc.part"
expect 0 '' "$tools/spc-build" --force "$scan" -o "$folder/keep.spc"
cmp -s "$folder/a.spc" "$folder/keep.spc" || fail "not the same bytes as before"
nothing_else

# --force replaces archives, not the scan itself, nor what is no plain file
cp "$scan" "$folder/self.ply"
for name in self.ply ./self.ply; do
    expect 1 "spc-build: '.*self.ply': the target is the scan itself" \
        "$tools/spc-build" --force "$folder/self.ply" -o "$folder/$name"
done
ln "$folder/self.ply" "$folder/link.spc"
expect 1 '.*the target is the scan itself' "$tools/spc-build" --force "$folder/self.ply" -o "$folder/link.spc"
cmp -s "$scan" "$folder/self.ply" || fail "the scan was replaced"
mkfifo "$folder/pipe.spc"
expect 1 "spc-build: '.*/pipe.spc': the target is a device or pipe.*" \
    "$tools/spc-build" --force "$scan" -o "$folder/pipe.spc"
[ -p "$folder/pipe.spc" ] || fail "a pipe was replaced"

# the remedy of --strict only where it is one
printf 'ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n-1e308 0 0\n1e308 0 0\n0 1 0\n3 0 1 2\n' >"$folder/wide.ply"
expect 1 "spc-build: '.*wide.ply': its coordinates span more than a double can measure" \
    "$tools/spc-build" "$folder/wide.ply" -o "$folder/b.spc"
one_line
absent "$folder/b.spc"

# a bad index is dropped, counted and warned about; --strict refuses
printf 'ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 3\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n3 0 1 9\n3 0 1 3\n' >"$folder/bad.ply"
expect 0 ".*bad.ply': warning: dropped 1 face with an index that names no vertex" \
    "$tools/spc-build" "$folder/bad.ply" -o "$folder/c.spc"
"$tools/spc-info" --json "$folder/c.spc" | grep -q '"bad_index": 1' || fail "the drop is not counted"
expect 1 "spc-build: '.*bad.ply': 1 faces cannot be used.*; without --strict they are dropped" \
    "$tools/spc-build" --strict "$folder/bad.ply" -o "$folder/d.spc"
one_line
absent "$folder/d.spc"

# what loses its shape is told, with the remedy; it stays told; --strict refuses
"$tools/gen-scan" --triangles 3000 --format ascii -o "$folder/plain.ply" 2>/dev/null
awk -v tiny=5 '
    /^element vertex/ { $3 = (vertices = $3) + 3 * tiny }
    /^element face/ { $3 += tiny; rows = -1 }
    body && ++rows == vertices + 1 { for (i = 0; i < tiny; i++) print "0.5 " i / 10 " 0.7\n0.50001 " i / 10 " 0.7\n0.5 " i / 10 " 0.70001" }
    { print }
    /^end_header/ { body = 1; rows = 0 }
    END { for (i = 0; i < tiny; i++) print 3, vertices + 3 * i, vertices + 3 * i + 1, vertices + 3 * i + 2 }
' "$folder/plain.ply" >"$folder/fine.ply"
expect 0 ".*fine.ply': warning: 5 triangles of 1.4e-05 to 1.4e-05 across lost their shape: vertices are moved by up to .*; --detail 1.4e-05 keeps them" \
    "$tools/spc-build" --json "$folder/fine.ply" -o "$folder/fine.spc"
grep -q '"lost_shape": 5' "$folder/out" || fail "--json does not count shapes"
"$tools/spc-info" "$folder/fine.spc" | grep -q '^changed *5 of 1.4e-05 to 1.4e-05 across lost their shape' ||
    fail "spc-info says nothing of shapes: $("$tools/spc-info" "$folder/fine.spc")"
quiet "$tools/spc-build" --codec raw "$folder/fine.spc" -o "$folder/finer.spc"
"$tools/spc-info" --json "$folder/finer.spc" | grep -q '"lost_shape": 5' || fail "an archive built anew forgets"
expect 1 "spc-build: '.*fine.ply': 5 triangles of .* across would lose their shape; --detail 1.4e-05 keeps them" \
    "$tools/spc-build" --strict "$folder/fine.ply" -o "$folder/shape.spc"
one_line
absent "$folder/shape.spc"
expect 0 '' "$tools/spc-build" --strict --detail 1.4e-05 "$folder/fine.ply" -o "$folder/shape.spc"
grep -q warning "$folder/err" && fail "--detail keeps nothing"
"$tools/spc-info" "$folder/shape.spc" | grep -q 'where no detail is fine' || fail "spc-info knows one lattice"
"$tools/spc-info" --json "$folder/shape.spc" | grep -q '"detail": 1.4' || fail "the metadata lacks the option"
expect 2 ".*--detail takes a length of 0 or more, not '-1'.*" "$tools/spc-build" --detail -1 "$folder/fine.ply" -o "$folder/x.spc"

# the contract's keys
expect 0 '' "$tools/spc-info" --json "$folder/a.spc"
for key in faces_in split_extra points_in leaves nodes clusters blocks triangles vertices height \
    file_bytes codec box min max error closed dropped bad_index non_finite degenerate sources name \
    format faces; do
    grep -q "\"$key\":" "$folder/out" || fail "spc-info --json lacks $key"
done
expect 0 '' "$tools/spc-build" --json -q --force "$scan" -o "$folder/a.spc"
grep -q '"leaves": 5' "$folder/out" || fail "spc-build --json says nothing of leaves"

# damage: exit 3 and the place
cp "$folder/a.spc" "$folder/bad.spc"
printf '\377' | dd of="$folder/bad.spc" bs=1 seek=30000 conv=notrunc 2>/dev/null
expect 3 "spc-info: '.*/bad.spc': .*(byte [0-9]+).*" "$tools/spc-info" --verify "$folder/bad.spc"
grep -q '^FAIL' "$folder/out" || fail "no invariant is named"
head -c 20000 "$folder/a.spc" >"$folder/short.spc"
expect 3 "spc-info: '.*/short.spc': the file ends at byte 20000 of [0-9]+.*" "$tools/spc-info" "$folder/short.spc"
expect 3 "spc-info: '.*/scan.ply': the file does not begin like an .spc archive" "$tools/spc-info" "$scan"
expect 1 "spc-info: '.*/none.spc': cannot open.*" "$tools/spc-info" "$folder/none.spc"

# an archive is a scan too; a damaged one is not, and who can help is named
expect 0 '' "$tools/spc-build" -q --codec raw "$folder/a.spc" -o "$folder/again.spc"
expect 0 '' "$tools/spc-info" --verify "$folder/again.spc"
expect 0 '' "$tools/spc-info" --json "$folder/again.spc"
grep -q '"codec": "raw"' "$folder/out" || fail "the archive was not built anew"
grep -q '"format": "spc"' "$folder/out" || fail "its source is not named"
for name in bad short; do
    expect 1 "spc-build: '.*/$name.spc': .*; 'spc-info --recover' rebuilds .*" \
        "$tools/spc-build" "$folder/$name.spc" -o "$folder/b.spc"
    one_line
    absent "$folder/b.spc"
done

# usage
for tool in spc-build spc-info spc-render; do
    expect 0 '' "$tools/$tool" --help
    [ "$(head -n 1 "$folder/out" | cut -c1-6)" = usage: ] || fail "$tool --help"
    [ "$(wc -l <"$folder/out")" -le 30 ] || fail "$tool --help does not fit a screen"
    expect 0 '' "$tools/$tool" --version
    expect 2 '.*--help.*' "$tools/$tool"
    expect 2 ".*'--nonsense' is no option.*" "$tools/$tool" --nonsense
done
expect 2 '.*--memory takes.*' "$tools/spc-build" --memory 1M "$scan" -o "$folder/e.spc"
expect 2 '.*no output is named.*' "$tools/spc-build" "$scan"
expect 2 '.*--codec takes.*' "$tools/spc-build" --codec lzma "$scan" -o "$folder/e.spc"
absent "$folder/e.spc"
if [ -e /dev/full ]; then
    expect 1 '.*cannot write to standard output.*' sh -c "$tools/spc-info --json $folder/a.spc >/dev/full"
fi

# memory is what was asked for however many parts there are; sanitizers add their own. Same bytes
case $tools in
*asan | *tsan) ;;
*)
    # within MB OPTIONS...: the scan becomes f.spc with no more memory than that
    within() {
        mb=$1
        shift
        expect 0 '' "$tools/spc-build" -q --force --json --memory "${mb}M" "$@" "$folder/scan.ply" \
            -o "$folder/f.spc"
        peak=$(sed -n 's/.*"peak_bytes": \([0-9]*\).*/\1/p' "$folder/out")
        [ "$peak" -le $((mb << 20)) ] || fail "a $shape takes $peak bytes of memory, --memory ${mb}M $*"
    }
    for shape in statue soup; do
        quiet "$tools/gen-scan" --triangles 400000 --shape $shape -o "$folder/scan.ply"
        within 64 --threads 2 --part-faces 1000
        expect 0 '' "$tools/spc-build" -q --force "$folder/scan.ply" -o "$folder/g.spc"
        cmp -s "$folder/f.spc" "$folder/g.spc" || fail "parts leave a trace in a $shape"
    done
    expect 1 ".*: clusters of 16777216 nodes in blocks of 32768 take at least [0-9]* MB of memory to build.*" \
        "$tools/spc-build" --force --cluster-nodes 16777216 --memory 64M "$folder/scan.ply" -o "$folder/g.spc"
    for small in "--cluster-nodes 16" "--block-nodes 4"; do
        # shellcheck disable=SC2086
        expect 1 ".* take at least [0-9]* MB of memory to build.*" \
            "$tools/spc-build" --force $small --memory 64M "$folder/scan.ply" -o "$folder/g.spc"
    done
    quiet "$tools/gen-scan" --triangles 400000 --shape soup --double --color --shuffle -o "$folder/scan.ply"
    within 64 --threads 1
    within 96 --threads 4
    shape=polygon                   # few faces, many triangles
    awk 'BEGIN {
        srand(1)
        print "ply\nformat ascii 1.0\nelement vertex 400000\nproperty float x\nproperty float y"
        print "property float z\nelement face 4\nproperty list uint uint vertex_indices\nend_header"
        for (i = 0; i < 400000; i++)
            print rand(), rand(), rand()
        for (f = 0; f < 4; f++) {
            printf "100000"
            for (i = 0; i < 100000; i++)
                printf " %d", f * 100000 + i
            print ""
        }
    }' >"$folder/scan.ply"
    within 64 --threads 8
    ;;
esac
