# the Debian packages, without installing them: deb.sh BUILD
. tests/cli/shared/begin.sh
case $tools in *asan | *tsan) echo "skipped: nobody packs what is built for tests"; exit 0 ;; esac
needs dpkg-deb dpkg-shlibdeps dpkg-architecture md5sum
names=$(for source in cmd/spc_*.c; do basename "$source" .c; done | tr _ -)
# shellcheck disable=SC2086
pack() { OUT=$folder/$1 scripts/deb "$tools" $names >"$folder/out.$1" 2>"$folder/err.$1" || fail "scripts/deb: $(cat "$folder/err.$1")"; }

# the same bytes, whoever makes them and when
pack one &
pack_one=$!
(umask 077 && export TZ=Asia/Tokyo && pack two) || fail "not under another mask"
wait $pack_one || fail "scripts/deb"
[ ! -s "$folder/err.one" ] || fail "scripts/deb warns: $(cat "$folder/err.one")"
for deb in "$folder"/one/*.deb; do
    cmp -s "$deb" "$folder/two/${deb##*/}" || fail "${deb##*/} has other bytes the second time"
done

check() { # PACKAGE FILE...: its sums hold, its modes are right, it belongs to root, and holds these
    name=$1
    shift
    dpkg-deb -R "$folder"/one/"${name}"_*.deb "$folder/$name"
    (cd "$folder/$name" && md5sum --quiet -c DEBIAN/md5sums) || fail "sums of $name"
    [ "$(wc -l <"$folder/$name/DEBIAN/md5sums")" -eq "$(find "$folder/$name/usr" -type f | wc -l)" ] || fail "$name has files without sums"
    dpkg-deb -c "$folder"/one/"${name}"_*.deb >"$folder/list"
    wrong=$(grep -vE '^(d|-rwxr-xr-x root/root .* \./usr/bin/)' "$folder/list" | grep -v '^-rw-r--r-- root/root ' || true)
    wrong=$wrong$(grep '^d' "$folder/list" | grep -v '^drwxr-xr-x root/root ' || true)
    [ -z "$wrong" ] || fail "$name: $wrong"
    for file in "$@" "usr/share/doc/$name/copyright" "usr/share/doc/$name/changelog.gz" "usr/share/doc/$name/changelog.Debian.gz"; do
        [ -s "$folder/$name/$file" ] || fail "$name has no $file"
    done
    ! grep -rlF -e "$PWD" -e /usr/local -e "$folder" "$folder/$name" || fail "these files of $name name other places"
}
check spc-tools usr/share/man/man5/spc.5.gz usr/share/man/man7/spc.7.gz usr/share/doc/spc-tools/spc-1.md
for name in $names; do
    for file in bin/$name share/man/man1/$name.1.gz share/bash-completion/completions/$name; do
        [ -s "$folder/spc-tools/usr/$file" ] || fail "spc-tools has no $file"
    done
done
for library in libc6 libzstd1 libxxhash0 libuv1 libjansson4 libglfw3; do
    grep -qE "^Depends: (.*, )?$library \\(>=" "$folder/spc-tools/DEBIAN/control" || fail "spc-tools does not need $library"
done
place=usr/lib/$(dpkg-architecture -qDEB_HOST_MULTIARCH)
check libspc-dev usr/include/spc.h "$place/libspc.a" "$place/pkgconfig/spc.pc"
[ ! -e "$folder/spc-tools/usr/include" ] || fail "spc-tools holds the header, too"
