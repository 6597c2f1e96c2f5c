#!/bin/sh
# Scans that are hard to divide: nothing is lost, the tree stays flat, clusters are neither empty nor
# too large, and none takes four times the time of a statue: hard.sh BUILD [TRIANGLES]
. tests/cli/shared/begin.sh
needs python3
triangles=${2:-20000}

# convert NAME: its archive, checked; sets cpu_ms
convert() {
    expect 0 '' "$tools/spc-build" -q --json --memory 64M --part-faces $((triangles / 9)) --force \
        "$folder/$1.ply" -o "$folder/a.spc"
    cp "$folder/out" "$folder/summary"
    expect 0 '' "$tools/spc-info" --verify=3 --json --clusters "$folder/a.spc"
    cpu_ms=$(python3 - "$folder/summary" "$folder/out" "$1" <<'END'
import json
import sys

summary, info = (json.load(open(name)) for name in sys.argv[1:3])
assert summary["faces_in"] == summary["leaves"] == info["leaves"], "leaves are lost"
assert info["height"] <= 60, f"{info['height']} levels"
counts = [c["inner"] + c["leaves"] for c in info["cluster_table"]]
assert min(counts) > 0, "an empty cluster"
assert max(counts) <= info["meta"]["options"]["cluster_nodes"], "a cluster too large"
print(round(summary["cpu_s"] * 1000))
END
    ) || fail "$1: $cpu_ms"
}

"$tools/gen-scan" --triangles "$triangles" --shape statue --double -o "$folder/statue.ply" 2>/dev/null
convert statue
statue_ms=$cpu_ms
for kind in outlier place same plane line cell needle powers; do
    python3 tests/cli/shared/hard_scans.py $kind "$triangles" "$folder/$kind.ply"
    convert $kind
    echo "$kind: $cpu_ms ms CPU, statue $statue_ms ms"
    [ "$cpu_ms" -le $((4 * statue_ms + 100)) ] || fail "$kind takes $cpu_ms ms, a statue $statue_ms ms"
    rm "$folder/$kind.ply"
done
