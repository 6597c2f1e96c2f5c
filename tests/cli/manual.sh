# every tool's --help, manual page, completions and table of options name the same: manual.sh BUILD
. tests/cli/shared/begin.sh
hidden="part-faces vertices-on-disk slice-log2"     # options for tests alone

same() { [ "$2" = "$3" ] || fail "$1: $(printf '%s\n' "$2" | tr '\n' ' ')are not $(printf '%s\n' "$3" | tr '\n' ' ')"; }
within() { # WHAT FILE FILE: every line of the first is one of the second
    extra=$(sort -u "$2" | comm -23 - "$3")
    [ -z "$extra" ] || fail "$1: $extra"
}
# The table of long options, from the source: what getopt takes is the one thing that is surely true.
table() {
    cat "cmd/spc_$1.c" $(ls cmd/"$1"_*.c 2>/dev/null) | sed -n '/struct option .*\[\]/,/};/p' |
        grep -oE '\{"[a-z0-9-]+"' | tr -d '{"' | grep -vxF "$(echo "$hidden" | tr ' ' '\n')" | sort
}
items() { sed -n 's/^\.It.* Fl Fl \([a-z0-9-]*\).*/\1/p' "$1" | sort; }

for source in cmd/spc_*.c; do
    word=${source#cmd/spc_}
    word=${word%.c}
    tool=spc-$(echo "$word" | tr _ -)
    page=cmd/man/$tool.1
    [ -f "$page" ] || fail "$tool has no manual page $page"
    table "$word" >"$folder/table"
    items "$page" >"$folder/items"
    [ -s "$folder/table" ] || fail "no table of options is found in $source"
    same "options of $tool and of $page" "$(cat "$folder/table")" "$(cat "$folder/items")"
    expect 0 '' "$tools/$tool" --help
    grep -oE -e '(^|[^a-z-])--[a-z][a-z0-9-]*' "$folder/out" | sed 's/.*--//' >"$folder/help"
    within "$tool --help names what $page does not" "$folder/help" "$folder/items"
    grep -oE 'Fl Fl [a-z0-9-]+' "$page" | sed 's/.* //' >"$folder/named"
    within "$page speaks of options that are none" "$folder/named" "$folder/items"

    # a screen is 24 lines of 80 columns; what it has no room for, --help=all tells
    lines=$(wc -l <"$folder/out")
    wide=$(grep -nE '.{81,}' "$folder/out" || true)
    if grep -qF -e '--help[=all]' "$folder/out"; then
        expect 0 '' "$tools/$tool" --help=all
        grep -oE -e '(^|[^a-z-])--[a-z][a-z0-9-]*' "$folder/out" | sed 's/.*--//' >"$folder/help"
        within "$tool --help=all names what $page does not" "$folder/help" "$folder/items"
        expect 2 "$tool: --help takes all, or nothing, not 'xyz'.*" "$tools/$tool" --help=xyz
    fi
    sort -u "$folder/help" >"$folder/told"
    within "options that $tool --help does not name" "$folder/table" "$folder/told"
    [ "$lines" -le 24 ] || fail "$tool --help is longer than 24 lines"
    [ -z "$wide" ] || fail "$tool --help is wider than 80 columns: $wide"

    # words that the page lists as values are taken: what is missing then is the file; no window is opened for that
    sed -n 's/^\.It.* Fl Fl \([a-z0-9-]*\) .*Cm \([a-z0-9| -]*\).*/\1 \2/p' "$page" | tr -d '|' >"$folder/values"
    offscreen=$(grep -xF offscreen "$folder/table" | sed "s,^,--,")
    while read -r option words; do
        [ "$option" != help ] || continue
        for value in $words; do
            # shellcheck disable=SC2086
            expect 2 "$tool: no .* is named.*" "$tools/$tool" $offscreen "--$option=$value"
        done
    done <"$folder/values"
done

# the page of the viewer has the keys of its table, in that order
if command -v python3 >/dev/null; then
    python3 - viewer/control.c cmd/man/spc-view.1 <<'PY' || fail "the keys of spc-view.1 are others than those of viewer/control.c"
import re, sys
names = {"LEFT": "Left", "RIGHT": "Right", "UP": "Up", "DOWN": "Down", "PAGE_UP": "Page Up", "PAGE_DOWN": "Page Down",
         "HOME": "Home", "ESCAPE": "Esc"}
def name(key, modifiers):
    if key.startswith("'"):
        key = key[1:-1].upper()
    elif key.startswith("SPV_KEY_F1"):
        key = "F%d" % sum(int(n) for n in key[len("SPV_KEY_F"):].split("+"))
    else:
        key = names[key[len("SPV_KEY_"):]]
    return ("Ctrl+" if "CONTROL" in modifiers else "") + key
table, told = [], []
source = open(sys.argv[1]).read().split("ROWS[] = {")[1].split("\n};")[0]
for key, modifiers, keys, words in re.findall(
        r"\{('.'|\w+(?: \+ \d+)?), (\w+), [^,]+, \w+, (NULL|\"[^\"]*\"), (NULL|\"[^\"]*\")\}", source):
    row = [k for k in keys.strip('"').split(", ")] if key == "0" else [name(key, modifiers)]
    table = table[:-1] + [table[-1] + row] if words == "NULL" else table + [row]
page = open(sys.argv[2]).read().split("KEYS:")[1].split(".El")[0]
for line in re.findall(r"^\.It (.*)$", page, re.M):
    told.append(line.replace("\\&", "").replace("\\-", "-").split(" , "))
assert len(table) > 20, table
for a, b in zip(table + [None] * 99, told):
    assert a == b, (a, b)
assert len(table) == len(told)
PY
fi

# pages lead to pages that exist, and are what the formatters take
for page in cmd/man/*.[1-9]; do
    name=$(basename "$page" ".${page##*.}")
    grep -qi "^\.Dt $name ${page##*.}\$" "$page" || fail "$page has another title"
    grep -E '^\.(It )?Xr ' "$page" | sed 's/^\.It /./' | while read -r _ other section _; do
        [ -f "cmd/man/$other.$section" ] || fail "$page refers to $other($section), which is not there"
    done
    if command -v mandoc >/dev/null; then
        found=$(mandoc -Tlint "$page" | grep -vE 'referenced manual not found|operating system explicitly' || true)
        [ -z "$found" ] || fail "$found"
    fi
    if command -v groff >/dev/null; then
        found=$(groff -ww -mandoc -Tascii "$page" 2>&1 >"$folder/page")
        [ -z "$found" ] || fail "$found"
        [ "$(wc -l <"$folder/page")" -gt 40 ] || fail "$page is nearly empty"
    fi
done

# completions: other shells take theirs, and bash offers what is to be offered
for page in cmd/man/*.1; do
    for shell in bash zsh fish; do
        scripts/completion $shell "$page" >"$folder/$shell"
        ! command -v $shell >/dev/null || expect 0 '' $shell -n "$folder/$shell"
        items "$page" | while read -r option; do
            grep -qE -e "(--|-l )$option([^a-z0-9-]|\$)" "$folder/$shell" || fail "$shell completes no --$option of $page"
        done
    done
done
needs bash
mkdir "$folder/scans" "$folder/scans/more"
touch "$folder/scans/a.ply" "$folder/scans/B.PLY" "$folder/scans/c.spc" "$folder/scans/d e.ply" "$folder/scans/f.txt" \
    "$folder/scans/g.png"
offers() { # WANTED TOOL WORD...: of the last word, one a line
    want=$1
    shift
    tree=$PWD
    # shellcheck disable=SC2016
    got=$(cd "$folder/scans" && bash -c '
        . <("$0/scripts/completion" bash "$0/cmd/man/$1.1")
        COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
        "_${1//-/_}" && printf "%s\n" "${COMPREPLY[@]}"' "$tree" "$@" | LC_ALL=C sort | tr '\n' ' ')
    [ "${got% }" = "$want" ] || fail "'$*' offers '$got', not '$want'"
}
offers 'raw zstd' spc-build --codec ''
offers 'raw' spc-build --codec = r
offers 'raw zstd' spc-build --codec =
offers '' spc-build --memory ''
offers '--progress' spc-build --prog
offers '--verify --version' spc-info --ve
offers 'B.PLY a.ply c.spc d e.ply more' spc-build --strict ''
offers 'd e.ply' spc-build d
offers 'c.spc more' spc-build a.ply -o ''
offers 'more' spc-build a.ply --out-dir ''
offers 'more' spc-build --temp ''
offers 'c.spc more' spc-info --verify ''
offers '1 2 3' spc-info --verify =
offers '2' spc-info --verify = 2
offers 'e normals radius size' spc-info --histogram ''
offers 'c.spc more' spc-render ''
offers 'g.png more' spc-render c.spc --output ''
offers 'hybrid points triangles' spc-render --mode ''
offers 'c.spc more' spc-view c.spc ''
offers 'hybrid points triangles' spc-view --mode ''
offers 'B.PLY a.ply c.spc d e.ply f.txt g.png more' spc-view --script ''
offers 'g.png more' spc-view --screenshot ''
offers 'all' spc-view --help =
