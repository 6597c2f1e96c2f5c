#include "script.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "suite.h"

static struct spv_script *parse(const char *text)
{
    struct spv_script *s;
    struct spc_error err = {0};
    /* An exactly sized copy, so that a memory checker sees a step behind it. */
    const size_t bytes = strlen(text);
    char *copy = malloc(bytes + !bytes);
    memcpy(copy, text, bytes);
    if (spv_script_parse(copy, bytes, &s, &err) != SPC_OK)
        ck_abort_msg("%s", err.what);
    free(copy);
    return s;
}

static void begin(struct spv_control *c)
{
    const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1}, up[3] = {0, 1, 0};
    ck_assert(spv_control_init(c, low, high, up, 45, 400, 400, NULL, NULL));
}

/* Plays a script; a letter a step into trace. */
static unsigned play(const struct spv_script *s, struct spv_control *c, char *trace, size_t size)
{
    struct spv_player p = {.script = s};
    unsigned frames = 0;
    size_t n = 0;
    for (;;) {
        const struct spv_step step = spv_script_next(&p, &c->pose);
        spv_script_control(&step, c);
        ck_assert(n + 3 < size);
        if (step.kind == SPV_STEP_EVENT) {
            trace[n++] = "kKbBmwrdpc"[step.event.kind];
        } else {
            trace[n++] = "FW.fotPemsS$"[step.kind];
        }
        trace[n] = '\0';
        if (step.kind == SPV_STEP_FRAME || step.kind == SPV_STEP_WAIT || step.kind == SPV_STEP_SCREENSHOT) {
            spv_control_step(c, SPV_SCRIPT_FRAME_S);
            frames++;
        }
        if (step.kind == SPV_STEP_END) {
            ck_assert(spv_script_next(&p, &c->pose).kind == SPV_STEP_END);
            return frames;
        }
    }
}

static void expect(const char *text, const char *trace)
{
    struct spv_control c;
    char got[256];
    begin(&c);
    struct spv_script *s = parse(text);
    const unsigned frames = play(s, &c, got, sizeof got);
    ck_assert_msg(strcmp(got, trace) == 0, "'%s': %s, not %s", text, got, trace);
    ck_assert_uint_eq(frames, spv_script_frames(s));
    spv_script_free(s);
}

START_TEST(each_command_becomes_its_steps)
{
    expect("", "$");
    expect("# nothing\n\n   \t \r\n", "$");
    expect("frames 3", "FFF$");
    expect("wait\nfit # all\norbit 30 20\norbit 30 20 5\r\n", "Wfoo$");
    expect("turn 90 10 3", "tFtFtF$");
    expect("eye 0 0 5 target 0 0 0\neye 0 0 5 target 0 0 0 up 1 0 0", "PP$");
    expect("path 2 eye 0 0 5 target 0 0 0", "PFPF$");
    expect("key q", "kK$");
    expect("key w shift ctrl 3", "kFFFK$");
    expect("key c ctrl 1", "kFK$");
    expect("drag left 0 0 9 9 1", "bmFB$");
    expect("drag right 0 0 9 9 3 shift", "bmFmFmFB$");
    expect("wheel 5 5 -2\ndoubleclick 3 3", "wbBbB$");
    expect("resize 640 480\neps 0.5\nmode points\nsplat fast", "rems$");
    expect("open a b.spc\nscreenshot x.png", "dS$");
    expect("frames 1\nquit\nframes 100", "F$");
}
END_TEST

START_TEST(events_hold_what_the_line_says)
{
    struct spv_script *s = parse("drag middle 10 20 30 60 2 shift alt\nkey PageUp ctrl\nwheel 7 8 -1.5\n"
                                 "doubleclick 3 4\nresize 640 480\nmode triangles\neps 2.5\n"
                                 "  screenshot  my scan#1.png  # front \nopen x y\n");
    struct spv_pose pose = {.fov_deg = 45};
    struct spv_player p = {.script = s};
    struct spv_step e = spv_script_next(&p, &pose);
    ck_assert(e.event.kind == SPV_EVENT_BUTTON && e.event.x == 10 && e.event.y == 20 && e.line == 1);
    ck_assert(e.event.button == SPV_BUTTON_MIDDLE && e.event.modifiers == (SPV_SHIFT | SPV_ALT));
    e = spv_script_next(&p, &pose);
    ck_assert(e.event.kind == SPV_EVENT_MOVE && e.event.x == 20 && e.event.y == 40);
    spv_script_next(&p, &pose);
    e = spv_script_next(&p, &pose);
    ck_assert(e.event.x == 30 && e.event.y == 60);
    spv_script_next(&p, &pose);
    e = spv_script_next(&p, &pose);
    ck_assert(e.event.kind == SPV_EVENT_BUTTON_UP && e.event.button == SPV_BUTTON_MIDDLE);
    e = spv_script_next(&p, &pose);
    ck_assert(e.event.key == SPV_KEY_PAGE_UP && e.event.modifiers == SPV_CONTROL && e.line == 2);
    spv_script_next(&p, &pose);
    e = spv_script_next(&p, &pose);
    ck_assert(e.event.steps == -1.5 && e.event.x == 7 && e.event.y == 8);
    ck_assert_int_eq(spv_script_next(&p, &pose).event.clicks, 1);
    spv_script_next(&p, &pose);
    ck_assert_int_eq(spv_script_next(&p, &pose).event.clicks, 2);
    spv_script_next(&p, &pose);
    e = spv_script_next(&p, &pose);
    ck_assert(e.event.width == 640 && e.event.height == 480);
    ck_assert(spv_script_next(&p, &pose).number[0] == 2);
    ck_assert(spv_script_next(&p, &pose).number[0] == 2.5);
    ck_assert_str_eq(spv_script_next(&p, &pose).path, "my scan#1.png");
    ck_assert_str_eq(spv_script_next(&p, &pose).event.path, "x y");
    spv_script_free(s);
}
END_TEST

START_TEST(the_camera_goes_where_it_is_told)
{
    struct spv_control c, d;
    char trace[256];
    begin(&c);
    begin(&d);
    struct spv_script *s = parse("orbit 30 20 5\nturn 60 -20 30\n");
    play(s, &c, trace, sizeof trace);
    spv_control_orbit(&d, 90, 0, 5);
    for (int a = 0; a < 3; a++)
        ck_assert_double_eq_tol(c.camera.eye[a], d.camera.eye[a], 1e-12);
    spv_script_free(s);
    s = parse("eye 0 0 10 target 0 0 0\npath 4 eye 8 0 10 target 4 0 0\nframes 1\n");
    struct spv_player p = {.script = s};
    struct spv_step step;
    double seen[8];
    int n = 0;
    while ((step = spv_script_next(&p, &c.pose)).kind != SPV_STEP_END) {
        spv_script_control(&step, &c);
        if (step.kind == SPV_STEP_FRAME)
            seen[n++] = c.pose.eye[0];
    }
    ck_assert_int_eq(n, 5);
    for (int i = 0; i < 5; i++)
        ck_assert_double_eq_tol(seen[i], i < 4 ? 2 * (i + 1) : 8, 1e-12);
    ck_assert(c.pose.eye[0] == 8 && c.pose.target[0] == 4 && c.pose.fov_deg == 45 && c.pose.up[1] == 1);
    spv_script_free(s);
    s = parse("eye 1 1 1 target 1 1 1\n");      /* no view: stays */
    play(s, &c, trace, sizeof trace);
    ck_assert(c.pose.eye[0] == 8);
    spv_script_free(s);
}
END_TEST

START_TEST(two_runs_are_the_same_bit_for_bit)
{
    struct spv_control c[2];
    char trace[4096];
    struct spv_script *s = parse("key v\nkey w 20\nkey d shift 7\ndrag left 100 100 300 200 9\nkey v\nwheel 100 90 3\n"
                                 "doubleclick 200 200\nframes 20\ndrag right 10 10 90 50 5\nkey 5\nframes 9\n"
                                 "turn 9 9 4");
    for (int i = 0; i < 2; i++) {
        begin(&c[i]);
        play(s, &c[i], trace, sizeof trace);
    }
    ck_assert_int_eq(memcmp(&c[0].camera, &c[1].camera, sizeof c[0].camera), 0);
    ck_assert_int_eq(memcmp(&c[0].pose, &c[1].pose, sizeof c[0].pose), 0);
    spv_script_free(s);
}
END_TEST

START_TEST(faults_name_line_and_word)
{
    static const struct {
        const char *text, *line, *word;
    } cases[] = {
        {"dance", "line 1:", "'dance'"}, {"\n\nframes x", "line 3:", "'x'"}, {"frames", "line 1:", "'frames'"},
        {"frames 0", "line 1:", "'0'"}, {"frames 1.5", "line 1:", "'1.5'"}, {"frames 1000001", "line 1:", "'1000001'"},
        {"frames 2 3", "line 1:", "'3'"}, {"frames -1", "line 1:", "'-1'"}, {"Frames 1", "line 1:", "'Frames'"},
        {"orbit 1", "line 1:", "'orbit'"}, {"orbit 1 2 0", "line 1:", "'0'"}, {"orbit nan 2", "line 1:", "'nan'"},
        {"orbit 1e999 2", "line 1:", "'1e999'"}, {"orbit 0x1 2", "line 1:", "'0x1'"},
        {"orbit inf 2", "line 1:", "'inf'"},
        {"turn 1 2", "line 1:", "'turn'"}, {"eye 1 2 3", "line 1:", "'eye'"}, {"eye 1 2 3 at 1 2 3", "line 1:", "'at'"},
        {"eye 1 2 3 target 1 2 3 up 1 2", "line 1:", "'eye'"}, {"path 3 target 1 2 3", "line 1:", "'target'"},
        {"key", "line 1:", "'key'"}, {"key f99", "line 1:", "'f99'"}, {"key w hyper", "line 1:", "'hyper'"},
        {"key # q", "line 1:", "'key'"}, {"drag up 1 1 2 2 3", "line 1:", "'up'"},
        {"drag left 1 1 2 2", "line 1:", "'drag'"},
        {"drag left 1 1 2 2 2 w", "line 1:", "'w'"}, {"wheel 1 2", "line 1:", "'wheel'"},
        {"resize 0 5", "line 1:", "'0'"}, {"resize 65536 5", "line 1:", "'65536'"}, {"eps 0", "line 1:", "'0'"},
        {"eps -3", "line 1:", "'-3'"}, {"mode both", "line 1:", "'both'"}, {"splat", "line 1:", "'splat'"},
        {"screenshot", "line 1:", "'screenshot'"}, {"screenshot # x.png", "line 1:", "'screenshot'"},
        {"wait 3", "line 1:", "'3'"}, {"quit now", "line 1:", "'now'"}, {"frames -", "line 1:", "'-'"},
        {"wait\nwheel 1 2 3 4 5 6 7 8 9 1 2 3 4 5 6 7 8 9 1 2 3 4 5 6 7 8 9", "line 2:", "too many"},
        {"frames 1\x1b[2J", "line 1:", "'1?[2J'"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct spv_script *s = (struct spv_script *)&s;
        struct spc_error err = {0};
        const enum spc_status status = spv_script_parse(cases[i].text, strlen(cases[i].text), &s, &err);
        ck_assert_msg(status == SPC_INPUT_FORMAT && s == NULL, "'%s'", cases[i].text);
        ck_assert_msg(strstr(err.what, cases[i].line) && strstr(err.what, cases[i].word), "'%s': %s", cases[i].text,
                      err.what);
    }
}
END_TEST

START_TEST(limits_hold)
{
    struct spv_script *s;
    struct spc_error err = {0};
    char *text = malloc(SPV_SCRIPT_BYTES + 1);
    memset(text, '\n', SPV_SCRIPT_BYTES + 1);
    ck_assert_int_eq(spv_script_parse(text, SPV_SCRIPT_BYTES + 1, &s, NULL), SPC_LIMIT);
    ck_assert_int_eq(spv_script_parse(text, SPV_SCRIPT_BYTES, &s, NULL), SPC_OK);
    spv_script_free(s);
    memset(text, ' ', SPV_SCRIPT_BYTES);
    ck_assert_int_eq(spv_script_parse(text, SPV_SCRIPT_LINE + 1, &s, &err), SPC_LIMIT);
    ck_assert_int_eq(spv_script_parse(text, SPV_SCRIPT_LINE, &s, NULL), SPC_OK);
    spv_script_free(s);
    for (int i = 0; i <= SPV_SCRIPT_COMMANDS; i++)
        memcpy(text + 5 * i, "wait\n", 5);
    ck_assert_int_eq(spv_script_parse(text, 5 * SPV_SCRIPT_COMMANDS, &s, NULL), SPC_OK);
    ck_assert_uint_eq(spv_script_frames(s), SPV_SCRIPT_COMMANDS);
    spv_script_free(s);
    ck_assert_int_eq(spv_script_parse(text, 5 * (SPV_SCRIPT_COMMANDS + 1), &s, NULL), SPC_LIMIT);
    ck_assert_int_eq(spv_script_parse("wait\0wait", 9, &s, NULL), SPC_INPUT_FORMAT);
    ck_assert_int_eq(spv_script_parse(NULL, 0, &s, NULL), SPC_OK);
    spv_script_free(s);
    free(text);
}
END_TEST

/* Bytes of scripts, mixed: refused or read, never more. */
START_TEST(random_text_does_no_harm)
{
    static const char *const words[] = {"frames", "wait", "eye", "target", "up", "1", "2", "3", "-1e5", "key", "w",
                                        "shift", "drag", "left", "open", "#", "\n", "\n", "\t", "\r", "1e308", "path",
                                        "quit", "orbit", "turn", "wheel", "screenshot", "\"", "\xff", "resize"};
    uint64_t state = 99;
    unsigned good = 0;
    for (int round = 0; round < 20000; round++) {
        char text[400];
        size_t n = 0;
        for (int i = 0; i < 12; i++) {
            state = state * UINT64_C(6364136223846793005) + 1442695040888963407u;
            n += (size_t)snprintf(text + n, sizeof text - n, "%s%s", words[(state >> 33) % 30],
                                  (state >> 60) % 4 ? " " : "");
        }
        char *copy = malloc(n);
        memcpy(copy, text, n);
        struct spv_script *s;
        const enum spc_status status = spv_script_parse(copy, n, &s, NULL);
        free(copy);
        ck_assert(status == SPC_OK || status == SPC_INPUT_FORMAT);
        if (status == SPC_OK) {
            struct spv_control c;
            struct spv_player p = {.script = s};
            struct spv_step step;
            begin(&c);
            do {
                step = spv_script_next(&p, &c.pose);
                spv_script_control(&step, &c);
                ck_assert(isfinite(c.camera.eye[0]));
            } while (step.kind != SPV_STEP_END);
            good++;
        }
        spv_script_free(s);
    }
    ck_assert_uint_gt(good, 20);
}
END_TEST

int main(void)
{
    return SUITE("script", NULL, NULL, each_command_becomes_its_steps, events_hold_what_the_line_says,
                 the_camera_goes_where_it_is_told, two_runs_are_the_same_bit_for_bit, faults_name_line_and_word,
                 limits_hold, random_text_does_no_harm);
}
