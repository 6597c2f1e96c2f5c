/*
 * oracle_case.h - for tests of viewing: archives of many kinds, and random eyes to judge them from.
 *
 * ORACLE_SEED=n takes other random numbers, ORACLE_VIEWS=n looks n times as often.
 */
#ifndef ORACLE_CASE_H
#define ORACLE_CASE_H

#include "oracle_tree.h"

struct oracle_case {
    const char *name;               /* of the archive */
    struct oracle_tree tree;
    struct spc_reader *reader;
    uint64_t seed;                  /* of the view, for messages */
    uint64_t state;                 /* random numbers that belong to it */
    struct spv_view view;
    uint8_t *exact, *shader, *walk; /* [node_count] scratch */
    bool *chosen;                   /* [block_count] scratch */
    struct spv_selection selection;
};

/* A folder for the archives, from the first test to the last: around SUITE in main. */
bool oracle_start(void);
void oracle_finish(void);

/* Calls check with each archive; builds it where no test has. Needs case_start as a fixture. */
void oracle_each(void (*check)(struct oracle_case *c));

/* How many views a case takes when it asks for n. */
uint32_t oracle_views(uint32_t n);

/* Takes random view number k: eye, direction, eps and mode; no culling. */
void oracle_look(struct oracle_case *c, uint32_t k);

/* The same, as people look: the model framed from outside, and eps 0.25 to 16 pixels. */
void oracle_frame(struct oracle_case *c, uint32_t k);

/* Puts the eye at a place and looks at another, or past it where they are the same. */
void oracle_look_at(struct oracle_case *c, const double eye[3], const double target[3]);

/* Selects for the view, and fills chosen. */
void oracle_select(struct oracle_case *c);

uint32_t oracle_pick(struct oracle_case *c, uint32_t n);    /* uniform in [0, n) */

/* Fails the test; says which archive, seed and view. */
_Noreturn void oracle_fail(const struct oracle_case *c, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

#endif
