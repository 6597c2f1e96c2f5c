# spc-bench as a user meets it: bench.sh BUILD
. tests/cli/shared/begin.sh
tools=$(cd "$tools" && pwd)
bench=$tools/spc-bench
"$tools/gen-scan" --triangles 20000 --shape statue --color -o "$folder/scan.ply" 2>/dev/null
"$tools/spc-build" -q --cluster-nodes 2000 "$folder/scan.ply" -o "$folder/a.spc"
cd "$folder"                    # short names in messages
plots="error-time.svg error-bytes.svg nodes-eps.svg"
few="--size 128x96 --repeat 2 --threads 2 --renderer soft"

# the columns WANTED of rows that CONDITION holds for, names as in the file
column() { # CONDITION WANTED FILE
    awk -F, -v OFS=' ' 'NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; next }
        function v(name) { return $at[name] } '"$1 { print $2 }" "$3"
}

quiet() { # nothing was said, but that there is no gnuplot where there is none
    ! grep -v 'no plots, for there is no gnuplot' err >left || fail "it says $(cat left)"
}

# all modes and baselines, in four views
# shellcheck disable=SC2086
expect 0 '' "$bench" a.spc --reference scan.ply --out t $few --eps 1,16,4 --baseline all --view close --view front \
    --view inside --view near
quiet
cp out table
[ "$(wc -l <table)" -eq 21 ] || fail "the table has $(wc -l <table) lines"
wide=$(grep -nE '.{81,}' table || true)
[ -z "$wide" ] || fail "the table is wider than 80 columns: $wide"
grep -q 'compared with the scan$' table || fail "the table does not say what the reference is"
[ "$(wc -l <t/trade.csv)" -eq $((1 + 4 * 3 * 7)) ] || fail "trade.csv has $(wc -l <t/trade.csv) lines"
for key in view mode eps_px nodes_processed nodes_tested nodes_drawn triangles_drawn bytes exact_elements exact_bytes \
    processed_ratio bytes_ratio frame_ms frame_ms_min frame_ms_max resident psnr_db ssim shade_mean shade_max overlap \
    overlap_tolerant covered_pixels hole_pixels off_pixels error_px_mean error_px_p999 error_px_max error_points \
    doubles_share; do
    head -1 t/trade.csv | grep -qE "(^|,)$key(,|\$)" || fail "trade.csv lacks $key"
    grep -q "\"$key\":" t/trade.json || fail "trade.json lacks $key"
done
for name in hybrid points triangles one-cluster traversal all-triangles all-points front close inside; do
    grep -q "\"$name\"" t/trade.json || fail "trade.json lacks $name"
done
if command -v gnuplot >/dev/null; then
    for name in $plots; do
        grep -q '</svg>' "t/$name" || fail "$name is no picture"
    done
fi

# what every trade must keep
bad=$(column 'v("hole_pixels") > 0' '$0' t/trade.csv)
[ -z "$bad" ] || fail "hole pixels: $bad"
[ "$(column 'v("hole_pixels") == "0" && v("frame_ms") > 0 && v("ssim") != ""' 1 t/trade.csv | wc -l)" -eq 60 ] ||
    fail "rows that are drawn lack a time or a comparison"
bad=$(column 'v("mode") == "hybrid" && v("error_px_max") > v("eps_px")' '$0' t/trade.csv)
[ -z "$bad" ] || fail "the error is larger than eps: $bad"
bad=$(column 'v("mode") == "hybrid" && v("eps_px") == 16 && !(v("error_px_max") > 1)' '$0' t/trade.csv)
[ -z "$bad" ] || fail "the error is small for eps 16: $bad"
bad=$(column 'v("processed_ratio") != "" && v("processed_ratio") < 1' '$0' t/trade.csv)
[ -z "$bad" ] || fail "less is processed than is drawn: $bad"
bad=$(column 'v("bytes_ratio") != "" && (v("bytes_ratio") > 2 * v("processed_ratio") || 2 * v("bytes_ratio") < v("processed_ratio"))' \
    '$0' t/trade.csv)
[ -z "$bad" ] || fail "an element's bytes are not those of a node: $bad"
bad=$(column 'v("view") == "close" && v("exact_elements") * 2 > v("nodes_drawn") + v("triangles_drawn")' '$0' t/trade.csv)
[ -z "$bad" ] || fail "most of the model would be in a close-up: $bad"
bad=$(column 'v("overlap_tolerant") != "" && v("overlap_tolerant") < 0.95' 'v("view"), v("mode"), v("eps_px")' t/trade.csv |
    grep -v ' 16$' || true)
[ -z "$bad" ] || fail "silhouettes differ: $bad"
# finer is nearer to the reference, and as near as triangles are
column 'v("view") == "front" && v("mode") == "hybrid"' 'v("psnr_db")' t/trade.csv >psnr
sort -rgc psnr 2>/dev/null || fail "PSNR does not fall with eps: $(cat psnr)"
# a framed model, with its back faces: a walk down the tree draws what the cut does, but for paths drawn twice
# shellcheck disable=SC2086
expect 0 '' "$bench" a.spc --reference scan.ply --out c $few --eps 1,4,16 --view above --mode hybrid --no-cull \
    --baseline traversal --baseline one-cluster
for eps in 1 4 16; do
    of() { column "v(\"eps_px\") == $eps && v(\"mode\") == \"$1\"" "$2" c/trade.csv; }
    drawn='v("nodes_drawn") + v("triangles_drawn")'
    cut=$(of hybrid "$drawn")
    walk=$(of traversal "$drawn")
    visited=$(of traversal 'v("nodes_processed")')
    list=$(of one-cluster 'v("nodes_processed")')
    awk -v cut="$cut" -v walk="$walk" -v visited="$visited" -v list="$list" -v twice="$(of hybrid 'v("doubles_share")')" \
        'BEGIN { exit !(walk > 100 && walk <= cut && cut <= walk * (1.02 + 4 * twice) && visited > walk && list >= cut) }' ||
        fail "eps $eps: $cut are drawn, $walk by a walk that visits $visited, $list are in a list"
done

# all views, one row each, and nothing but the table is said
# shellcheck disable=SC2086
expect 0 '' "$bench" a.spc --reference scan.ply --out n $few --eps 4 --mode hybrid
quiet
[ "$(column 'v("hole_pixels") == "0"' 'v("view")' n/trade.csv | tr '\n' ' ')" = \
    "front right back left above below near close inside " ] || fail "nine views give $(cut -d, -f1 n/trade.csv)"

# pictures do not depend on threads and memory: all but times are the same
# shellcheck disable=SC2086
expect 0 '' "$bench" a.spc --reference scan.ply --out u $few --eps 1,16,4 --baseline all --threads 5 --memory 16M \
    --view inside --view near
untimed() { cut -d, -f1-12,16- "$1" >"$2"; }
untimed t/trade.csv all && grep -E "^(view|near|inside)," all >one
untimed u/trade.csv two
diff one two >differ || fail "another number of threads gives others: $(head -4 differ)"

# fewer of everything; its own triangles as the reference; a folder that is there
mkdir v
# shellcheck disable=SC2086
expect 0 '' "$bench" a.spc --out v $few --view close --view front --mode hybrid --eps 2 --json
[ "$(wc -l <v/trade.csv)" -eq 3 ] || fail "trade.csv has $(wc -l <v/trade.csv) lines, not 3"
cmp -s out v/trade.json || fail "--json prints another report"
grep -q '"reference": "archive"' out || fail "the report does not say what the reference is"
expect 1 "spc-bench: 'v': holds a trade already; --force writes over it" "$bench" a.spc --out v
# shellcheck disable=SC2086
expect 0 '' "$bench" a.spc --out v $few --view front --mode points --eps 3 --force
grep -q 'front,points,3,' v/trade.csv || fail "--force did not write"

# recommendations: one line, exit 0
# shellcheck disable=SC2086
one() { # PATTERN OPTION...
    answer=$1
    shift
    expect 0 '' "$bench" a.spc --recommend $few --view front --view close "$@"
    [ "$(wc -l <out)" -eq 1 ] || fail "$* says more than a line: $(cat out)"
    grep -qE "^$answer\$" out || fail "$* recommends '$(cat out)'"
}
one "eps 0.25 in hybrid mode: the finest measured that keeps 0.01 frames/s; slowest view '(front|close)' .* ms, .*" --fps 0.01
one "eps 16 in hybrid mode: the coarsest measured that keeps an error of 16 px; largest error .* 0 hole pixels" \
    --error 16 --reference scan.ply
one "eps .* comes nearest, but no eps measured keeps 1e\+06 frames/s; .*" --fps 1000000 --mode hybrid
one "eps 16 in points mode: .* shades to 200 of 255; .*" --shade 200 --mode points
# shellcheck disable=SC2086
expect 0 '' "$bench" a.spc --recommend --error 3 $few --view front --json --eps 1,8
grep -q '"eps_px": [18].0*,*$' out || fail "the report recommends nothing: $(grep -A6 recommend out)"
[ ! -e trade.csv ] || fail "files without --out"

# what fails says so in one line: file, fault, remedy
# shellcheck disable=SC2086
refuses() { expect "$@" $few; }
"$tools/gen-scan" --triangles 5000 --shape statue -o other.ply 2>/dev/null
refuses 1 "spc-bench: 'other.ply': the archive was not built from this scan: it has 5.* faces, not .*; --reference takes .*" \
    "$bench" a.spc --reference other.ply --out w
one_line
sed '/^end_header/q' scan.ply >cut.ply
refuses 1 "spc-bench: 'none.ply': cannot open.*" "$bench" a.spc --reference none.ply --out w
refuses 1 "spc-bench: 'cut.ply': .*" "$bench" a.spc --reference cut.ply --out w
flat() { # Z: two triangles there, ascii
    printf 'ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n'
    printf 'element face 2\nproperty list uchar int vertex_indices\nend_header\n'
    printf "0 0 $1\n1 0 $1\n0 1 $1\n1 1 $1\n3 0 1 2\n3 1 3 2\n"
}
flat 0 >flat.ply
flat 5 >moved.ply
"$tools/spc-build" -q flat.ply -o flat.spc
refuses 1 "spc-bench: 'moved.ply': .*: it lies elsewhere; .*" "$bench" flat.spc --reference moved.ply --out w
[ ! -e w ] || fail "the folder of a failed run is left"
"$tools/spc-build" -q --no-triangles scan.ply -o points.spc
refuses 1 "spc-bench: 'points.spc': .*; name the scan with --reference" "$bench" points.spc --out w
# shellcheck disable=SC2086
expect 0 '' "$bench" points.spc --out w $few --reference scan.ply --view front --eps 4 --baseline all
column 'v("mode") ~ "triangles"' '$0' w/trade.csv | grep . && fail "triangles of points"
refuses 3 "spc-bench: 'scan.ply': the file does not begin like.*" "$bench" scan.ply --out x
refuses 1 "spc-bench: 'none.spc': cannot open.*" "$bench" none.spc --out x
refuses 1 "spc-bench: 'a.spc': is no folder; .*" "$bench" a.spc --out a.spc
refuses 1 "spc-bench: 'no/x': cannot make the folder.*" "$bench" a.spc --out no/x
# no half trade: a new folder goes again, an old trade stays
for folder_of in new old; do
    [ $folder_of = new ] || { mkdir old; echo mine >old/trade.json; }
    got=0
    # shellcheck disable=SC2086
    (ulimit -f 4; exec "$bench" a.spc --out $folder_of --force $few --view front) >out 2>err || got=$?
    [ $got -eq 1 ] && grep -q "^spc-bench: '$folder_of/trade.*': cannot write it: File too large" err ||
        fail "a file that may not grow gives exit $got: $(cat err)"
done
[ ! -e new ] || fail "this is left of a trade: $(ls new)"
[ "$(cat old/trade.json)" = mine ] || fail "the old trade is lost"
# without gnuplot all but the plots is there
mkdir bin
# shellcheck disable=SC2086
expect 0 "spc-bench: 'y': warning: no plots, for there is no gnuplot .*; then run 'gnuplot plots.gp' there" \
    env PATH="$folder/bin" "$bench" a.spc --out y $few --view front --eps 4 --mode hybrid
[ -s y/plots.gp ] || fail "no script for gnuplot"
[ ! -e y/error-time.svg ] || fail "a plot without gnuplot"

# any eps keeps its column; of points nothing can be measured with triangles
# shellcheck disable=SC2086
expect 0 '' "$bench" a.spc --out z $few --view front --mode points --eps 0.001,1234.5,10000
wide=$(grep -nE '.{81,}' out || true)
[ -z "$wide" ] && [ "$(awk '$1 == "points" { print NF, $2 }' out | tr '\n' ' ')" = "12 0.001 12 1234 12 10000 " ] ||
    fail "the table is $(cat out)"
grep -q '^1 view of 128 x 96, ' out || fail "one view is $(head -n 1 out)"
for options in "--out none" "--recommend --fps 1"; do
    # shellcheck disable=SC2086
    expect 1 "spc-bench: 'points.spc': it holds points only, no triangles" "$bench" points.spc --reference scan.ply \
        --mode triangles --baseline all-triangles $few $options
    one_line
done
[ ! -e none ] || fail "an empty trade is left"

# all pictures equal: gnuplot has nothing to warn of
printf 'ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n' >line.ply
printf 'element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n' >>line.ply
"$tools/spc-build" -q line.ply -o line.spc
# shellcheck disable=SC2086
expect 0 '' "$bench" line.spc --out l $few --view front --eps 1,4
quiet

# usage
for options in "" "--out x --eps 0" "--out x --eps 1,1" "--out x --eps 1,,2" "--out x --mode lines" "--out x --view top" \
    "--out x --baseline no" "--out x --repeat 0" "--recommend" "--out x --fps 30" "--recommend --fps 0" \
    "--out x --size 8x8" "--out x more" "--out x --progress no" "--out x --eps 1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17"; do
    # shellcheck disable=SC2086
    expect 2 'spc-bench: .*--help.*' "$bench" a.spc $options
    one_line
done
[ ! -e x ] || fail "a folder was made"
