/*
 * mtl.h - materials of OBJ files, by name: their colours and what pictures they are covered with.
 *
 * The table holds the names that an OBJ file uses; reading a library fills in what it says of
 * them. Its memory is bounded, whatever the files hold.
 */
#ifndef SPB_MTL_H
#define SPB_MTL_H

#include "texture.h"

enum {
    MTL_NAME_MAX = 1023,                /* bytes of a name that count */
    MTL_MATERIALS_MAX = 16384,
    MTL_TEXT_MAX = 4 << 20              /* bytes of all names together */
};

#define MTL_NONE UINT32_MAX

struct mtl_material {
    uint32_t name;                      /* all names: places in mtl.text, ended by a zero */
    bool defined;                       /* some library says what it is */
    bool colored;                       /* and what colour */
    uint8_t rgba[4];                    /* white where not */
    uint32_t map;                       /* name of the picture; MTL_NONE: none */
    uint32_t folder;                    /* of the library that names it */
    uint32_t texture;                   /* as of spb_textures_add; MTL_NONE: none */
    struct spb_placement placement;
};

struct mtl {
    struct mtl_material *materials;
    uint32_t count;
    char *text;
    size_t text_bytes, text_room;
    uint32_t *slots;                    /* [slot_count] hash table of numbers, or MTL_NONE */
    uint32_t slot_count;
    uint64_t left_out;                  /* names that found no room, each time they came */
};

/* fails SPC_NO_MEMORY */
enum spc_status spb_mtl_init(struct mtl *mtl, struct spc_error *err);
void spb_mtl_release(struct mtl *mtl);

/* The material of that name, length bytes; MTL_NONE: there is none. */
uint32_t spb_mtl_find(const struct mtl *mtl, const char *name, size_t length);

/* Adds it when it is new and there is room. fails SPC_NO_MEMORY */
enum spc_status spb_mtl_add(struct mtl *mtl, const char *name, size_t length, struct spc_error *err);

/*
 * Reads a library: what it says of materials in the table that no other has defined.
 * fails  SPC_INPUT_FORMAT when it cannot be opened or read: going on loses colours, no more;
 *        SPC_NO_MEMORY
 */
enum spc_status spb_mtl_read(struct mtl *mtl, const char *path, struct spc_error *err);

#endif
