# What every script here begins with; $1 is the build folder. Sourced from the top of the tree.
set -eu
tools=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
fail() {
    echo "$*"
    exit 1
}
# expect CODE PATTERN COMMAND...: exit code, and a line of stderr that the pattern matches whole
expect() {
    code=$1
    pattern=$2
    shift 2
    got=0
    "$@" >"$folder/out" 2>"$folder/err" || got=$?
    [ $got -eq "$code" ] || fail "$* exits $got, not $code: $(cat "$folder/err")"
    [ -z "$pattern" ] || grep -qE "^$pattern\$" "$folder/err" ||
        fail "$* should say '$pattern', says: $(cat "$folder/err")"
}
one_line() { [ "$(wc -l <"$folder/err")" -eq 1 ] || fail "more than one line: $(cat "$folder/err")"; }
# needs PROGRAM...: the script ends well, and says so, where one is missing
needs() {
    for program in "$@"; do
        command -v "$program" >/dev/null || { echo "skipped: there is no $program"; exit 0; }
    done
}
