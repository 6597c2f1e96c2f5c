# make install, what a program makes of it, and make uninstall: install.sh BUILD
. tests/cli/shared/begin.sh
unset MAKEFLAGS MFLAGS PREFIX DESTDIR BINDIR LIBDIR INCLUDEDIR DATADIR PKGCONFIGDIR MANDIR DOCDIR
unset BASHCOMPDIR ZSHCOMPDIR FISHCOMPDIR
needs make objcopy
config=${tools#build/}
version=$(sed -n 's/^#define SPC_TOOL_VERSION "\(.*\)"$/\1/p' format/spc.h)

# every tool with its page and completions; nothing is built anew; modes do not depend on who installs
touch "$folder/stamp"
(umask 077 && make -s install CONFIG="$config" DESTDIR="$folder/root") || fail "make install fails"
new=$(find "$tools" ! -name '*.log' ! -type d -newer "$folder/stamp")
[ -z "$new" ] || fail "make install writes into the build folder: $new"
place=$folder/root/usr/local
for source in cmd/spc_*.c; do
    tool=$(basename "$source" .c | tr _ -)
    [ "$("$place/bin/$tool" --version)" = "$tool $version" ] || fail "$tool is not installed, or another version"
    for file in man/man1/"$tool.1" bash-completion/completions/"$tool" zsh/site-functions/_"$tool" \
        fish/vendor_completions.d/"$tool.fish"; do
        [ -s "$place/share/$file" ] || fail "$tool is installed without share/$file"
    done
done
for file in man/man5/spc.5 man/man7/spc.7 doc/spc/LICENSE doc/spc/CHANGELOG.md doc/spc/spc-1.md; do
    [ -s "$place/share/$file" ] || fail "share/$file is not installed"
done
wrong=$(find "$folder/root" -mindepth 1 ! -path "*/bin/*" -type f ! -perm 644 -o -path "*/bin/*" ! -perm 755 \
    -o -mindepth 1 -type d ! -perm 755)
[ -z "$wrong" ] || fail "modes: $wrong"
! grep -rlF "$PWD" "$folder/root" || fail "these name the tree they were built in"
! grep -rlF "$folder" "$folder/root" || fail "these name DESTDIR"
! grep -rl '@[A-Z]*@' "$place/share/man" || fail "these pages hold a name that was not filled in"

# a program that has the installed files only, in C and in C++; a name of its own meets none of the library's
case $config in
*asan) flags='-fsanitize=address,undefined' ;;
*tsan) flags=-fsanitize=thread ;;
*) flags= ;;
esac
foreign=$(nm -g --defined-only "$place/lib/libspc.a" | awk 'NF == 3 && $3 ~ /^[a-z]/ && $3 !~ /^spc_/ { print $3 }')
[ -z "$foreign" ] || fail "the library has names without spc_: $foreign"
packages() { PKG_CONFIG_PATH=$place/lib/pkgconfig PKG_CONFIG_SYSROOT_DIR=$folder/root ${PKG_CONFIG:-pkg-config} "$@"; }
use() { # COMPILER OPTION...
    # shellcheck disable=SC2046,SC2086
    "$@" -Wall -Wextra -pedantic -Werror $flags $(packages --static --cflags spc) \
        tests/install/first_blocks.c -x none $(packages --static --libs spc) -o "$folder/first_blocks" || fail "$* cannot build with it"
    for archive in spec/conformance/good/*.spc; do
        nodes=$("$place/bin/spc-info" --json "$archive" | sed -n 's/^ *"nodes": \([0-9]*\),*/\1/p' | head -n 1)
        expect 0 '' "$folder/first_blocks" "$archive"
        grep -qE "^$nodes nodes, [1-9][0-9]* in first blocks\$" "$folder/out" ||
            fail "$archive has $nodes nodes, the program says: $(cat "$folder/out")"
    done
    expect 1 'first_blocks: .*' "$folder/first_blocks" spec/conformance/bad/cut-in-data.spc
}
if command -v "${PKG_CONFIG:-pkg-config}" >/dev/null; then
    [ "$(packages --modversion spc)" = "$version" ] || fail "spc.pc has another version"
    use "${CC:-cc}" -std=c11
    ! command -v "${CXX:-c++}" >/dev/null || use "${CXX:-c++}" -std=c++17 -x c++
else
    echo "skipped: there is no pkg-config"
fi

# nothing stays, also of folders of one's own, with spaces
make -s uninstall CONFIG="$config" DESTDIR="$folder/root"
left=$(find "$folder/root" ! -type d -o -path '*/doc/spc')
[ -z "$left" ] || fail "make uninstall leaves $left"
set -- DESTDIR="$folder/a b" PREFIX=/opt/spc LIBDIR=/lib64 MANDIR=/opt/man BINDIR=/opt/bin
make -s install CONFIG="$config" "$@"
grep -qx 'libdir=/lib64' "$folder/a b/lib64/pkgconfig/spc.pc" || fail "spc.pc does not name LIBDIR"
grep -qF /opt/spc/share/doc/spc/spc-1.md "$folder/a b/opt/man/man5/spc.5" || fail "spc.5 does not name DOCDIR"
[ -x "$folder/a b/opt/bin/spc-info" ] || fail "BINDIR is not kept"
make -s uninstall CONFIG="$config" "$@"
left=$(find "$folder/a b" ! -type d)
[ -z "$left" ] || fail "make uninstall leaves $left"
expect 2 "install: 'usr' must begin with /.*|make: .*" make -s install CONFIG="$config" PREFIX=usr DESTDIR="$folder/c"
[ ! -e "$folder/c" ] || fail "a refused prefix leaves something behind"
