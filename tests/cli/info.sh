# the tables and histograms of spc-info as a user meets them: info.sh BUILD
. tests/cli/shared/begin.sh
info() { expect 0 '' "$tools/spc-info" "$@"; }
same() { [ "$2" = "$3" ] || fail "$1: $2, not $3"; }
fact() { sed -n "s/^ *\"$1\": \([0-9]*\),*\$/\1/p" "$folder/facts" | head -n 1; }
rows() { sed '1,3d;/^total/,$d' "$folder/out"; }        # of a table
total() { sed -n '/^total/p' "$folder/out"; }
column() { awk -v c="$1" '{ print $c }'; }
sum() { awk '{ s += $1 } END { printf "%.0f\n", s }'; }
# members NAME: the values of a member in JSON, one a line, in order
members() { grep -o "\"$1\": *[^],}]*" "$folder/out" | sed 's/.*: *//'; }
aligned() {
    same "$1: width of the lines" "$(sed 1,2d "$folder/out" | awk '{ print length }' | sort -u | wc -l)" 1
    same "$1: columns of the lines" "$(sed 1,2d "$folder/out" | awk '{ print NF }' | sort -u)" "$2"
    [ "$(awk 'length > w { w = length } END { print w }' "$folder/out")" -le 120 ] || fail "$1: over 120 columns"
}
valid_json() {
    ! command -v python3 >/dev/null || python3 -m json.tool <"$folder/out" >/dev/null || fail "$1 is no JSON"
}

"$tools/gen-scan" --triangles 20000 --shape statue --color -o "$folder/scan.ply" 2>/dev/null
archive=$folder/a.spc
"$tools/spc-build" -q --cluster-nodes 2000 --block-nodes 500 "$folder/scan.ply" -o "$archive"
"$tools/spc-info" --json "$archive" >"$folder/facts"
nodes=$(fact nodes)
leaves=$(fact leaves)
clusters=$(fact clusters)
data_bytes=$(($(fact file_bytes) - ($(fact head_bytes) + 63) / 64 * 64))
[ "$clusters" -gt 12 ] || fail "the archive is too simple for this test"

# a line a cluster, and their sums
info --clusters "$archive"
aligned clusters 18
same "end of the groups" "$(awk 'NR == 2 { print length }' "$folder/out")" "$(awk 'NR == 3 { print length }' "$folder/out")"
same "lines" "$(rows | wc -l)" "$clusters"
same "ids" "$(rows | column 1 | tr '\n' ' ')" "$(seq -s ' ' 0 $((clusters - 1))) "
check_sum() { # NAME COLUMN VALUE
    same "sum of $1" "$(rows | column "$2" | sum)" "$3"
    same "total of $1" "$(total | column "$2")" "$3"
}
check_sum children 4 $((clusters - 1))
check_sum inner 5 $((nodes - leaves))
check_sum leaves 6 "$leaves"
check_sum blocks 7 "$(fact blocks)"
check_sum bytes 8 "$data_bytes"
rows | awk '
    $3 == "-" ? $1 != 0 || $2 != 0 : $3 >= $1 || $2 != level[$3] + 1 { print "parent of " $1; bad = 1 }
    { level[$1] = $2; if ($3 != "-") kids[$3]++; said[$1] = $4 }
    $9 > $10 || ($12 != "inf" && $11 > $12) || $13 > $14 { print "range of " $1; bad = 1 }
    $9 + 0 > $11 + 0 { print "e_self over e_parent in " $1; bad = 1 }
    ($12 == "inf") != ($1 == 0) { print "the root is in " $1; bad = 1 }
    $15 < 1.98 * $14 || $16 < 1.98 * $14 || $17 < 1.98 * $14 { print "a ball leaves the box of " $1; bad = 1 }
    $18 > 180 { print "cone of " $1; bad = 1 }
    END { for (c in said) if (said[c] != kids[c] + 0) { print "children of " c; bad = 1 }; exit bad }' ||
    fail "clusters break a rule"
extreme() { rows | column "$1" | sort -g | sed -n "$2"; }
for c in 9 11 13; do same "least of column $c" "$(total | column $c)" "$(extreme $c 1p)"; done
for c in 10 14; do same "largest of column $c" "$(total | column $c)" "$(extreme $c '$p')"; done
for c in 15 16 17; do
    total | awk -v c=$c -v most="$(extreme $c '$p')" '$c < .99 * most { exit 1 }' || fail "the box of all is too small"
done
rows | awk '{ print $1, $5 + $6, $9, $11, $14 }' >"$folder/cluster_nodes"
unit=$(sed -n '1s/.*lengths in \(.*\) *file units.*/\1/p' "$folder/out")
largest_error=$(total | column 10)
near() { awk -v a="$2" -v b="$3" 'BEGIN { exit !(a > .99 * b && a < 1.01 * b) }' || fail "$1: $2, not near $3"; }

info --json --clusters "$archive"
valid_json --clusters
same "rows in JSON" "$(members id | wc -l)" "$clusters"
same "bytes in JSON" "$(members bytes | sum)" "$data_bytes"
same "the facts in JSON" "$(members file_bytes)" "$(fact file_bytes)"
grep '"id": ' "$folder/out" >"$folder/cluster_json"
# range NAME: least and largest of a length over the archive, file units
range() {
    sed "s/.*\"$1\": {\"min\": \([^,]*\), \"max\": \([^}]*\)}.*/\1 \2/" "$folder/cluster_json" |
        awk 'NR == 1 || $1 + 0 < a { a = $1 + 0 } $2 + 0 > b { b = $2 + 0 } END { printf "%.12g %.12g\n", a, b }'
}

# lengths of tables are in the unit that stands above them
near "largest error" "$(echo "$largest_error ${unit:-1}" | awk '{ print $1 * $2 }')" "$(range e_self | cut -d ' ' -f 2)"

# a line a block: of all clusters together, everything that the archive holds
: >"$folder/blocks"
while read -r id count e_self e_parent radius; do
    info --blocks "$id" "$archive"
    aligned "blocks of $id" 14
    same "nodes of cluster $id" "$(total | column 7)" "$count"
    for c in 5 6 7 8; do same "column $c, cluster $id" "$(total | column $c)" "$(rows | column $c | sum)"; done
    same "e_self of cluster $id" "$(rows | column 11 | sort -g | head -n 1)" "$e_self"
    same "e_parent of cluster $id" "$(rows | column 9 | sort -g | head -n 1)" "$e_parent"
    same "radius of cluster $id" "$(rows | column 13 | sort -g | tail -n 1)" "$radius"
    same "links of cluster $id" "$(rows | column 12 | sort -gr)" "$(rows | column 12)"
    rows | awk '($10 != "inf" && $9 > $10) || !($14 > 0) { exit 1 }' || fail "ranges in cluster $id"
    rows | awk 'NR > 1 && ($10 == "inf" || (last != "inf" && $10 + 0 > last + 0)) { exit 1 } { last = $10 }' ||
        fail "blocks of $id are not in prefix order"
    rows >>"$folder/blocks"
done <"$folder/cluster_nodes"
same "indices" "$(column 1 <"$folder/blocks" | sort -n | tr '\n' ' ')" "$(seq -s ' ' 0 $(($(fact blocks) - 1))) "
same "bytes stored" "$(column 5 <"$folder/blocks" | sum)" $(($(fact inner) + $(fact leaf)))
same "vertices" "$(column 8 <"$folder/blocks" | sum)" "$(fact vertices)"
same "leaves" "$(awk '$2 == "leaf" { print $7 }' "$folder/blocks" | sum)" "$leaves"
same "codec" "$(column 3 <"$folder/blocks" | sort -u)" zstd
same "offsets grow" "$(sort -n "$folder/blocks" | column 4)" "$(column 4 <"$folder/blocks" | sort -n)"
info --json --blocks 3 "$archive"
valid_json --blocks
same "nodes of cluster 3" "$(grep '"index":' "$folder/out" | sed 's/.*"nodes": \([0-9]*\).*/\1/' | sum)" \
    "$(awk '$1 == 3 { print $2 }' "$folder/cluster_nodes")"

# histograms count every node once, fit 80 columns, and their ends are those of the directory
check_histogram() { # OF TOTAL
    info --histogram "$1" "$archive"
    sed '1,2d;/^ *total/d' "$folder/out" | sed 's/[#=]*$//; s/ *$//' >"$folder/bins"
    same "$1: sum" "$(awk '{ print $(NF - 2) }' "$folder/bins" | sum)" "$2"
    same "$1: total" "$(awk '/^ *total/ { print $2, $3 }' "$folder/out")" "$2 100.00"
    same "$1: last sum" "$(awk 'END { print $NF }' "$folder/bins")" 100.00
    awk -v n="$2" '{ s += $(NF - 2); p = $(NF - 2) * 100 / n; q = s * 100 / n }
        p - $(NF - 1) > .006 || $(NF - 1) - p > .006 || q - $NF > .006 || $NF - q > .006 { exit 1 }' \
        "$folder/bins" || fail "$1: percentages"
    [ "$(awk 'length > w { w = length } END { print w }' "$folder/out")" -lt 80 ] || fail "$1: over 80 columns"
    same "$1: bins without a bar" "$(sed '1,2d;/^ *total/d' "$folder/out" | grep -vc '[#=]$' || true)" \
        "$(awk '$(NF - 2) == 0' "$folder/bins" | wc -l)"
    same "$1: longest bar" "$(grep -oE '[#=]+$' "$folder/out" | awk 'length > w { w = length } END { print w }')" 35
    info --json --histogram "$1" "$archive"
    valid_json "--histogram $1"
    sed -n '/"histogram":/,$p' "$folder/out" >"$folder/json"
    mv "$folder/json" "$folder/out"
    same "$1: JSON" "$(members count | sum) $(members total)" "$2 $2"
}
check_ends() { # NAME: the range of all clusters lies just in the first and last bins
    # shellcheck disable=SC2046
    set -- "$1" $(range "$1") "$(members min | head -n 1)" "$(members max | head -n 1)" \
        "$(members min | tail -n 1)" "$(members max | tail -n 1)"
    echo "$*" | awk '!($4 <= $2 && $2 < $5 && $6 <= $3 && $3 < $7) { exit 1 }' || fail "ends of $*"
}
check_histogram e "$nodes"
same "e: leaves" "$(members leaves | sum)" "$leaves"
same "e: inner" "$(members inner | sum)" $((nodes - leaves))
check_ends e_self
near "first border" "$(awk -v u="${unit:-1}" 'NR == 1 { print $1 * u }' "$folder/bins")" "$(members min | head -n 1)"
check_histogram radius "$nodes"
check_ends radius
check_histogram normals "$nodes"
same "normals: leaves" "$(members leaves | sum)" "$leaves"
same "normals: axes" "$(wc -l <"$folder/bins")" "$(fact normal_clusters)"
same "normals: order" "$(column 3 <"$folder/bins" | sort -gr)" "$(column 3 <"$folder/bins")"
check_histogram size "$clusters"
[ "$(wc -l <"$folder/bins")" -gt 1 ] || fail "all sizes are in one bin"
awk '/"bytes": / { sub(/.*"bytes": /, ""); print $0 + 0 }' "$folder/cluster_json" | sort -n >"$folder/sizes"
same "size: ends" "$(members min_bytes | head -n 1 | awk -v v="$(head -n 1 "$folder/sizes")" '{ print ($1 <= v) }') $(
    members max_bytes | tail -n 1 | awk -v v="$(tail -n 1 "$folder/sizes")" '{ print ($1 > v) }')" "1 1"

# bytes: every byte of the file is in one stream, whatever the archive
check_bytes() { # NAME ARCHIVE
    "$tools/spc-info" --json "$2" >"$folder/facts"
    info --bytes "$2"
    sed '1d;/^$/,$d' "$folder/out" >"$folder/streams"
    same "$1: sum of the streams" "$(sed '/^total/d' "$folder/streams" | awk '{ print $(NF - 2) }' | sum)" \
        "$(fact file_bytes)"
    same "$1: total" "$(awk '/^total/ { print $2, $3 }' "$folder/streams")" "$(fact file_bytes) 100.00"
    awk -v n="$(fact file_bytes)" -v l="$(fact leaves)" '{ b = $(NF - 2); p = b * 100 / n - $(NF - 1); q = b / l - $NF }
        p > .006 || p < -.006 || q > .0006 || q < -.0006 { print; exit 1 }' "$folder/streams" || fail "$1: shares"
    [ "$(awk 'length > w { w = length } END { print w }' "$folder/out")" -lt 80 ] || fail "$1: over 80 columns"
    grep -oE '1/[0-9.]+ of the (median|box)' "$folder/out" | sed 's|1/||' >"$folder/shares"
    info --json --bytes "$2"
    valid_json "$1: --bytes"
    same "$1: JSON" "$(members stored_bytes | sed 1d | sum)" "$(fact file_bytes)"
    # half the diagonal of the lattice, as shares of three lengths
    awk -v m="$(members vertex_moved_max)" -v r="$(members leaf_radius_median)" -v e="$(members leaf_longest_edge_median)" \
        -v d="$(members box_diagonal)" '{ v = (NR == 1 ? r : NR == 2 ? e : d) / m; if (v > $1 + .51 || v < $1 - .51) exit 1 }
        END { if (NR != 3) exit 1 }' "$folder/shares" || fail "$1: precision"
    members half_angle_deg | grep -q . && fail "$1: tables that nobody asked for"
    return 0
}
least() { awk -v a="$2" -v b="$3" 'BEGIN { exit !(a <= b) }' || fail "$1: $2 is over $3"; }
check_bytes colours "$archive"
# what a builder promises: steps a radius, bits of a length, normals
least "steps of centres" "$(members max | tail -n 1)" 0.125
same "rounding" "$(members radius | tr '\n' ' ')" "0.0625 0.00390625 "
for angle in $(members normal_deg); do least "normals" "$angle" 1.2; done
"$tools/spc-build" -q --codec raw "$folder/scan.ply" -o "$folder/raw.spc"
check_bytes raw "$folder/raw.spc"
"$tools/spc-build" -q --no-triangles "$folder/scan.ply" -o "$folder/points.spc"
check_bytes points "$folder/points.spc"
info --bytes "$folder/points.spc"
head -n 1 "$folder/out" | grep -q '/leaf$' || fail "bytes of points are not told by leaves"
"$tools/gen-scan" --triangles 1 --shape plane -o "$folder/one.ply" 2>/dev/null
"$tools/spc-build" -q "$folder/one.ply" -o "$folder/one.spc"
check_bytes "a triangle or two" "$folder/one.spc"
"$tools/spc-info" --json "$archive" >"$folder/facts"

# the first picture: the head and all of cluster 0 behind it
info --json --blocks 0 "$archive"
same "end of the root cluster" "$(fact first_picture_bytes)" "$(
    grep '"index":' "$folder/out" | tail -n 1 |
        sed 's/.*"offset": \([0-9]*\).*"stored_bytes": \([0-9]*\).*/\1 \2/' |
        awk '{ print $1 + int((64 + $2 + 63) / 64) * 64 }')"

# all normals of a plane are one direction; few axes are counted by octant
"$tools/gen-scan" --triangles 500 --shape plane -o "$folder/plane.ply" 2>/dev/null
"$tools/spc-build" -q --no-triangles --normal-clusters 128 "$folder/plane.ply" -o "$folder/plane.spc"
info --histogram normals "$folder/plane.spc"
same "filled directions" "$(sed '1,2d;/total/d' "$folder/out" | grep -c '[#=]$')" 1
grep -E '^ +-?0\.1[0-9] +-?0\.[01][0-9] +0\.9[0-9] ' "$folder/out" | grep -q ' 100.00 100.00 [#=]*$' ||
    fail "the plane does not look along z"
info --blocks 0 "$folder/plane.spc"
same "vertices of points" "$(total | column 8)" 0
"$tools/spc-build" -q --force --normal-clusters 3 "$folder/scan.ply" -o "$folder/few.spc"
info --histogram normals "$folder/few.spc"
same "octants" "$(sed '1,2d;/total/d' "$folder/out" | cut -c 1-18 | sort -u | wc -l)" 8
grep -q octant "$folder/out" || fail "octants are not named"

# several at once, in one order; the summary stands alone
info --verify=1 --bytes --histogram size --blocks 0 --clusters "$archive"
same "order of the parts" \
    "$(grep -oE '^([0-9]+ clusters on|blocks of|stored bytes|what the bytes are|ok )' "$folder/out" | tr '\n' ' ')" \
    "$clusters clusters on blocks of stored bytes what the bytes are ok  "
grep -q '^nodes ' "$folder/out" && fail "the summary is printed with the tables"
info --json --verify=1 --bytes --histogram size --blocks 0 --clusters "$archive"
valid_json "all at once"
for key in verify histogram bytes cluster_table block_table; do
    same "members $key" "$(grep -c "^  \"$key\":" "$folder/out")" 1
done

# a reader that goes away is no fault, whether or not the caller ignores the signal
same "head" "$("$tools/spc-info" --clusters "$archive" 2>&1 | head -n 1 | cut -d ' ' -f 2)" clusters
for trap in - ''; do
    (
        trap "$trap" PIPE
        {
            sleep 0.1
            "$tools/spc-info" --clusters --histogram e "$archive" 2>"$folder/err" || true
        } | :
    )
    [ ! -s "$folder/err" ] || fail "a closed pipe is spoken of: $(cat "$folder/err")"
done
if [ -c /dev/full ]; then
    expect 1 '.*cannot write to standard output.*' sh -c "$tools/spc-info --clusters $archive >/dev/full"
fi

# wrong usage; damage
expect 2 "spc-info: '.*a.spc' has the clusters 0 to $((clusters - 1)) and no $clusters;.*" \
    "$tools/spc-info" --blocks "$clusters" "$archive"
one_line
[ ! -s "$folder/out" ] || fail "a table of no cluster"
expect 2 '.*has the clusters.*' "$tools/spc-info" --json --clusters --blocks 4000000000 "$archive"
[ ! -s "$folder/out" ] || fail "half an object"
expect 2 ".*--blocks takes the id of a cluster, not '-1'.*" "$tools/spc-info" --blocks -1 "$archive"
expect 2 ".*--histogram takes e, radius, normals or size, not 'colour'.*" \
    "$tools/spc-info" --histogram colour "$archive"
one_line
expect 2 ".*lacks its value.*" "$tools/spc-info" "$archive" --histogram
cp "$archive" "$folder/bad.spc"
size=$(wc -c <"$archive")
printf '\377\377' | dd of="$folder/bad.spc" bs=1 seek=$((size - 2000)) conv=notrunc 2>/dev/null
expect 3 "spc-info: '.*/bad.spc': checksum of block [0-9]+ does not match.*" \
    "$tools/spc-info" --histogram e "$folder/bad.spc"
one_line
[ ! -s "$folder/out" ] || fail "a histogram of a part"
expect 3 ".*checksum of block.*" "$tools/spc-info" --bytes "$folder/bad.spc"
one_line
[ ! -s "$folder/out" ] || fail "bytes of a part"
expect 3 '' "$tools/spc-info" --json --histogram e "$folder/bad.spc"
valid_json "a damaged archive"
grep -q '"histogram"' "$folder/out" && fail "a histogram of a part in JSON"
info --clusters --histogram size "$folder/bad.spc"
