/*
 * build.h - a scan becomes an archive.
 *
 * Stages, a file each, in the order the data flows: source.h (ply.h and others) reads, chain.h makes
 * one of several, vertices.h and faces.h
 * meet (through vertex_cache.h or corner_sort.h where the vertices are on disk), distribute.h puts
 * faces on disk by place, plan.h finds the parts, top.h builds them and what is above (split.h,
 * tree.h), pack.h makes clusters, spool.h keeps them until the archive is written. budget.h says
 * how much memory each may take. Points without faces become disks between plan and parts (points.h);
 * their archives hold no triangles.
 */
#ifndef SPB_BUILD_H
#define SPB_BUILD_H

#include "progress.h"
#include "salvage.h"
#include "spool.h"
#include "spc.h"

enum spb_cull { SPB_CULL_AUTO, SPB_CULL_NONE, SPB_CULL_BACK };

struct spb_scan_facts {             /* of one scan */
    char format[32];
    uint64_t vertices, faces;       /* declared, or counted */
    char remark[400];               /* what the reader wants to be known, or "" */
};

struct spb_build_options {          /* spb_build_defaults, then change */
    const char *scan, *out;         /* paths; a scan "-" is standard input */
    const char *const *more;        /* [more_count] further scans, into the same archive */
    uint32_t more_count;
    struct spb_scan_facts *facts;   /* [1 + more_count], to be filled in; NULL: not wanted */
    const char *temp;               /* folder of temporary files; NULL: the output's */
    bool force;                     /* replace an existing archive */
    bool salvage;                   /* scan is a damaged archive: build from what is whole of it */
    bool strict;                    /* dropped faces are a failure: SPC_INPUT_BAD */
    double detail;                  /* file units: faces at least so large keep their shape, however few
                                       they are; below 0: what is fine where many such are */
    bool triangles;                 /* keep them for drawing near the eye */
    bool paper_error;
    enum spb_cull cull;
    enum spc_codec codec;
    int level;
    uint32_t cluster_nodes, block_nodes;
    uint32_t normal_clusters;       /* 0: 128 where back faces are culled, else 1 */
    uint64_t memory;                /* bytes that the process may take, at least 64 MiB */
    uint64_t part_faces;            /* 0: from memory; tests force many small parts */
    bool vertices_on_disk;          /* for tests, whatever the memory, */
    int slice_log2;                 /* and their corners sorted by slices of 2^n vertices; 0: if need be */
    unsigned threads;               /* 0: all cores */
    struct spb_progress progress;
    /*
     * Makes the metadata: JSON text from malloc, which the build frees; NULL: out of memory.
     * Must depend on the scan and on options that shape the bytes alone (I10).
     */
    char *(*meta)(void *ctx, const struct spc_header *header);
    void *meta_ctx;
};

enum spb_phase { SPB_OPEN, SPB_READ_VERTICES, SPB_SORT_CORNERS, SPB_READ_FACES, SPB_PLAN,
                 SPB_ESTIMATE_POINTS, SPB_BUILD_PARTS, SPB_WRITE_ARCHIVE, SPB_PHASE_COUNT };
extern const char *const spb_phase_name[SPB_PHASE_COUNT];

struct spb_phase_cost {
    double wall_s, cpu_s;           /* of all threads */
    uint64_t temp_written, temp_read;           /* bytes */
};

struct spb_build_report {           /* for the summary; valid after success */
    struct spc_header header;
    uint64_t vertices;              /* sum over the scans' facts */
    uint32_t parts;
    uint64_t temp_written, temp_read;           /* sums over the phases */
    struct spb_phase_cost phases[SPB_PHASE_COUNT];
    double step;                    /* file units: what the scan's numbers resolve where they are largest */
    struct spb_shapes shapes;       /* what the vertices' lattice has changed; lengths in file units */
    double detail_least;            /* file units: what any lattice can keep */
    int coarse_exp;                 /* vertices lie on 2^that, or finer where the scan is; the header's is the finest */
    double short_edge;              /* file units: a tenth of the edges are about that short or shorter */
    struct spb_salvage salvage;     /* with options.salvage */
    bool closed;                    /* every edge meets its reverse, volume is positive */
};

void spb_build_defaults(struct spb_build_options *options);

/*
 * Builds options->out from options->scan. On failure no file has the target's name that had it
 * not before, and an old target is untouched.
 *
 * fails  SPC_EXISTS, SPC_BUSY, SPC_IO, SPC_NO_MEMORY, SPC_CANCELLED, SPC_INPUT_*, those of
 *        spc_reader_open and spc_block_decode where a scan is an archive; err->what names no file:
 *        that is *file (may be NULL), options->out or the name of a scan
 */
enum spc_status spb_build(const struct spb_build_options *options, struct spb_build_report *report,
                          const char **file, struct spc_error *err);

#endif
