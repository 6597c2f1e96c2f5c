#include "plain_face.h"

#include <math.h>
#include <string.h>

void plain_record_store(const struct spb_record_format *format, const double corner[3][3],
                      const uint8_t rgba[3][4], uint8_t *record)
{
    if (format->wide) {
        memcpy(record, corner, 72);
        record += 72;
    } else {
        float narrow[9];
        for (int i = 0; i < 9; i++)
            narrow[i] = (float)corner[i / 3][i % 3];
        memcpy(record, narrow, 36);
        record += 36;
    }
    if (format->colors)
        memcpy(record, rgba, 12);
}

void plain_record_load(const struct spb_record_format *format, const struct spb_space *space,
                     const uint8_t *record, struct plain_face *out)
{
    double xyz[9];
    float narrow[9];
    if (format->wide) {
        memcpy(xyz, record, 72);
        record += 72;
    } else {
        memcpy(narrow, record, 36);
        record += 36;
        for (int i = 0; i < 9; i++)
            xyz[i] = (double)narrow[i];
    }
    for (int i = 0; i < 9; i++)
        out->corner[i / 3][i % 3] = spb_space_from_file(space, i % 3, xyz[i]);
    if (format->colors)
        memcpy(out->rgba, record, 12);
    else
        memset(out->rgba, 255, 12);
}

void plain_face_key(const struct plain_face *face, double key[3])
{
    for (int a = 0; a < 3; a++) {
        const double x = face->corner[0][a], y = face->corner[1][a], z = face->corner[2][a];
        const double min = fmin(x, fmin(y, z)), max = fmax(x, fmax(y, z));
        key[a] = (min + max) / 2 + 1 - 1;
    }
}

double plain_from_lattice(const struct spb_space *space, double number)
{
    return ldexp(number, space->vertex_exp - space->unit_exp);
}
