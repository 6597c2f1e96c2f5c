/*
 * letters.h - the strokes of the printable ASCII characters, ' ' first.
 *
 * A point is a column 0..6 and a row a..n: capitals and digits stand on row k and reach up to row c,
 * small letters to row e, tails go down to row n. Points are joined in order, a space lifts the pen, a
 * point alone is a dot. A point with a capital row is one that a curve is drawn to, not through; between
 * two of those it passes halfway.
 */
#ifndef SPV_LETTERS_H
#define SPV_LETTERS_H

enum { LETTER_COLUMNS = 7, LETTER_ROWS = 16 };

static const char *const LETTERS[] = {
    "", "3c3h 3k", "2b2d 4b4d", "2c2k 4c4k 1e5e 1i5i",                                   /* space ! " # */
    "5d5C3c1C1G3g5G5K3k1K1j 3b3l", "5c1k 1c2c2e1e1c 4i5i5k4k4i",                         /* $ % */
    "5h5K2k1K1i1H3f4E4d4C3c2C2d2e5k", "3b3d", "4b2D2J4l", "2b4D4J2l",                     /* & ' ( ) */
    "3d3i 1e5h 5e1h", "3e3i 1g5g", "3j3k2m", "1g5g", "3k", "5b1l",                       /* * + , - . / */
    "3c5C5g5K3k1K1g1C3c 4f2h", "1e3c3k 1k5k", "1e1C3c5C5e5G1k5k", "1d1C3c5C5G3g2g 3g5G5K3k1K1j",    /* 0 1 2 3 */
    "4k4c1h5h", "5c1c1f3f5F5K3k1K1j", "5d5C3c1C1g1K3k5K5F3f1F1h",                        /* 4 5 6 */
    "1c5c2k", "3g1G1C3c5C5G3g1G1K3k5K5G3g", "1j1K3k5K5g5C3c1C1H3h5H5f",                  /* 7 8 9 */
    "3f 3k", "3f 3j3k2m", "5d1g5j", "1f5f 1h5h", "1d5g1j", "1d1C3c5C5d5F3g3h 3k",        /* : ; < = > ? */
    "5k3k1K1g1C3c5C5f5i4i3I3F4f5f", "1k3c5k 2h4h", "1c1k3k5K5G3g1g 1c3c5C5G3g",          /* @ A B */
    "5d5C3c1C1g1K3k5K5j", "1c1k2k5K5g5C2c1c", "5c1c1k5k 1g4g", "5c1c1k 1g4g",            /* C D E F */
    "5d5C3c1C1g1K3k5K5h5g3g", "1c1k 5c5k 1g5g", "2c4c 2k4k 3c3k", "5c5h5K3k1K1i",        /* G H I J */
    "1c1k 5c1h 2g5k", "1c1k5k", "1k1c3g5c5k", "1k1c5k5c", "3c5C5g5K3k1K1g1C3c",          /* K L M N O */
    "1k1c3c5C5H3h1h", "3c5C5g5K3k1K1g1C3c 3h5m", "1k1c3c5C5G3g1g 3g5k", "5d5C3c1C1G3g5G5K3k1K1j",   /* P Q R S */
    "1c5c 3c3k", "1c1h1K3k5K5h5c", "1c3k5c", "1c2k3f4k5c", "1c5k 5c1k", "1c3g5c 3g3k", "1c5c1k5k",   /* T .. Z */
    "4b2b2l4l", "1b5l", "2b4b4l2l", "1f3c5f", "0m6m", "2b4e",                            /* [ \ ] ^ _ ` */
    "1f1E3e5E5g5k 5h3h1H1K3k5K5i", "1c1k 1h1E3e5E5h5K3k1K1h", "5f5E3e1E1h1K3k5K5j",      /* a b c */
    "5c5k 5h5E3e1E1h1K3k5K5h", "1h5h5E3e1E1h1K3k5K5j", "5c4c2C2e2k 1f4f",                /* d e f */
    "5e5l5N3n1N1m 5h5E3e1E1h1K3k5K5h", "1c1k 1h1E3e5E5h5k", "1e3e3k 1k5k 3b",            /* g h i */
    "2e4e4l4N2n1n 4b", "1c1k 5e1i 2h5k", "1c3c3i3K5k", "1e1k 1g1E2e3E3g3k 3g3E4e5E5g5k", /* j k l m */
    "1e1k 1h1E3e5E5h5k", "3e5E5h5K3k1K1h1E3e", "1e1n 1h1E3e5E5h5K3k1K1h",                /* n o p */
    "5e5n 5h5E3e1E1h1K3k5K5h", "1e1k 1h1E3e5E5f", "5f5E3e1E1H3h5H5K3k1K1j",              /* q r s */
    "2c2i2K4k5k 1e5e", "1e1h1K3k5K5h 5e5k", "1e3k5e", "1e2k3g4k5e", "1e5k 5e1k",         /* t u v w x */
    "1e3k 5e2n1n", "1e5e1k5k", "5b3B3e3G1g3G3i3L5l", "3b3m", "1b3B3e3G5g3G3i3L1l", "1h1F3g5H5f",    /* y z { | } ~ */
};

#endif
