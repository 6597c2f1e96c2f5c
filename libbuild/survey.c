#include "survey.h"

#include "vec.h"
#include "vectors.h"

enum { BATCH = 64, BIN_OF_ONE = SPB_EDGE_BINS - 64 };

struct batch {
    double file[9][BATCH];          /* corners, file units; what is beyond the last repeats it */
    double at[9][BATCH];            /* units */
    double volume[BATCH];
    double shortest[BATCH];         /* squared; infinite when every edge is 0 */
    double longest[BATCH];          /* squared */
};

void spb_survey_init(struct spb_survey *survey)
{
    *survey = (struct spb_survey){.volume = 0};
    for (int a = 0; a < 3; a++) {
        survey->file_min[a] = HUGE_VAL;
        survey->file_max[a] = -HUGE_VAL;
    }
}

SPB_INLINE void load(bool is_wide, uint32_t bytes, const uint8_t *records, uint32_t n,
                     struct batch *b)
{
    for (uint32_t i = 0; i < BATCH; i++) {
        const uint8_t *record = records + (size_t)(i < n ? i : n - 1) * bytes;
        double wide[9];
        float narrow[9];
        if (is_wide)
            memcpy(wide, record, sizeof wide);
        else
            memcpy(narrow, record, sizeof narrow);
        for (int k = 0; k < 9; k++)
            b->file[k][i] = is_wide ? wide[k] : (double)narrow[k];
    }
}

SPB_VECTORS static void widen(const struct batch *b, struct spb_measures *m)
{
    for (int k = 0; k < 9; k++) {
        double min = m->file_min[k % 3], max = m->file_max[k % 3];
        for (uint32_t i = 0; i < BATCH; i++) {
            min = smaller_of(b->file[k][i], min);
            max = larger_of(b->file[k][i], max);
        }
        m->file_min[k % 3] = min;
        m->file_max[k % 3] = max;
    }
}

/* Squared edge from corner k to corner l. */
SPB_INLINE double edge_of(const struct batch *b, int k, int l, uint32_t i)
{
    const double x = b->at[l][i] - b->at[k][i], y = b->at[l + 1][i] - b->at[k + 1][i];
    const double z = b->at[l + 2][i] - b->at[k + 2][i];
    return x * x + y * y + z * z;
}

/* The square, unless it is 0 or not below s. */
SPB_INLINE double shorter(double square, double s)
{
    return square > 0 ? smaller_of(square, s) : s;
}

SPB_VECTORS static void measure(const struct spb_space *space, struct batch *b)
{
    const double scale = ldexp(1, -space->unit_exp);
    for (int k = 0; k < 9; k++) {
        const double origin = space->origin[k % 3];
        for (uint32_t i = 0; i < BATCH; i++)
            b->at[k][i] = (b->file[k][i] - origin) * scale;
    }
    for (uint32_t i = 0; i < BATCH; i++) {
        const double p = edge_of(b, 0, 3, i), q = edge_of(b, 3, 6, i), r = edge_of(b, 6, 0, i);
        b->shortest[i] = shorter(p, shorter(q, shorter(r, HUGE_VAL)));
        b->longest[i] = larger_of(p, larger_of(q, r));
    }
    for (uint32_t i = 0; i < BATCH; i++) {
        const double x = b->at[4][i] * b->at[8][i] - b->at[5][i] * b->at[7][i];
        const double y = b->at[5][i] * b->at[6][i] - b->at[3][i] * b->at[8][i];
        const double z = b->at[3][i] * b->at[7][i] - b->at[4][i] * b->at[6][i];
        b->volume[i] = b->at[0][i] * x + b->at[1][i] * y + b->at[2][i] * z;
    }
}

/* By the exponent as it is stored: subnormal squares share a bin, far below any lattice. */
int16_t spb_survey_bin(double square)
{
    uint64_t bits;
    memcpy(&bits, &square, sizeof bits);
    const int bin = (int)(bits >> 52) - 1022 + BIN_OF_ONE;
    return (int16_t)(square == HUGE_VAL ? -1 : bin < SPB_EDGE_BINS ? bin : SPB_EDGE_BINS - 1);
}

void spb_survey_measure(const struct spb_record_format *format, const struct spb_space *space,
                        const uint8_t *records, uint32_t count, struct spb_measures *m,
                        struct spb_bins *bins)
{
    struct batch b;
    *m = (struct spb_measures){.file_min = {HUGE_VAL, HUGE_VAL, HUGE_VAL},
                               .file_max = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};
    for (uint32_t first = 0; first < count; first += BATCH) {
        const uint32_t n = count - first < BATCH ? count - first : BATCH;
        if (format->wide)
            load(true, format->bytes, records + (size_t)first * format->bytes, n, &b);
        else
            load(false, format->bytes, records + (size_t)first * format->bytes, n, &b);
        widen(&b, m);
        measure(space, &b);
        for (uint32_t i = 0; i < n; i++) {
            m->volume += b.volume[i];
            bins[first + i] = (struct spb_bins){
                spb_survey_bin(b.shortest[i]), b.longest[i] > 0 ? spb_survey_bin(b.longest[i]) : -1};
        }
    }
}

void spb_survey_add(struct spb_survey *survey, const struct spb_measures *m,
                    const struct spb_bins *bins, uint32_t count)
{
    for (int a = 0; a < 3; a++) {
        survey->file_min[a] = smaller_of(m->file_min[a], survey->file_min[a]);
        survey->file_max[a] = larger_of(m->file_max[a], survey->file_max[a]);
    }
    survey->volume += m->volume;
    for (uint32_t i = 0; i < count; i++) {
        if (bins[i].edge >= 0)
            survey->edge_bins[bins[i].edge]++;
        if (bins[i].size >= 0)
            survey->size_bins[bins[i].size]++;
    }
}

uint64_t spb_survey_smaller(const struct spb_survey *survey, int size_exp)
{
    const int end = spb_survey_bin(times_exp2(1, 2 * size_exp));
    uint64_t below = 0;
    for (int i = 0; i < end; i++)
        below += survey->size_bins[i];
    return below;
}

double spb_survey_short_edge(const struct spb_survey *survey)
{
    uint64_t total = 0, below = 0;
    for (int i = 0; i < SPB_EDGE_BINS; i++)
        total += survey->edge_bins[i];
    for (int i = 0; i < SPB_EDGE_BINS && total > 0; i++) {
        below += survey->edge_bins[i];
        if (below > total / 10) {
            const int square = i - BIN_OF_ONE - 1;          /* squares of the bin are >= 2^square */
            return times_exp2(1, (square - (square & 1)) / 2);
        }
    }
    return 0;
}
