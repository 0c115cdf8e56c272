/* On a PC, with the sanitisers: the golden frames, and calls that must fail without harm. `test NAME=FILE.psb ...` */
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "draw.h"
#include "pocketsplat.h"

#define CHECK(condition)                                                     \
  do {                                                                       \
    if (!(condition)) {                                                      \
      fprintf(stderr, "%s:%d: %s does not hold\n", __FILE__, __LINE__, #condition); \
      exit(1);                                                               \
    }                                                                        \
  } while (0)

void say(const char *text) { fputs(text, stdout); }

static void *run(void *task) {
  const psb_task *of_thread = task;
  of_thread->run(of_thread->state);
  return NULL;
}

void do_both(void *user, psb_task here, psb_task there) {
  pthread_t thread;
  (void)user;
  CHECK(pthread_create(&thread, NULL, run, &there) == 0);
  here.run(here.state);
  CHECK(pthread_join(thread, NULL) == 0);
}

/* Does each task twice, of which the second time does nothing. */
static void do_twice(void *user, psb_task here, psb_task there) {
  (void)user;
  for (int i = 0; i < 2; i++) run(&there), run(&here);
}

/* Which task is left undone, and at which call. */
struct undone {
  int at_call, is_here;
};

static void do_one(void *user, psb_task here, psb_task there) {
  struct undone *undone = user;
  const int is_whole = undone->at_call-- != 0;
  if (is_whole || !undone->is_here) run(&here);
  if (is_whole || undone->is_here) run(&there);
}

static int32_t count(void *user, uint16_t x, uint16_t y, uint16_t width, uint16_t height, const uint8_t *rgb) {
  (void)x, (void)y, (void)width, (void)height, (void)rgb;
  return ++*(int32_t *)user, 0;
}

static int32_t refuse(void *user, uint16_t x, uint16_t y, uint16_t width, uint16_t height, const uint8_t *rgb) {
  (void)x, (void)y, (void)width, (void)height, (void)rgb;
  return ++*(int32_t *)user == 2 ? 77 : 0;
}

static int32_t take(void *user, uint16_t x, uint16_t y, uint16_t width, uint16_t height, const uint8_t *rgb) {
  (void)user, (void)x, (void)y, (void)width, (void)height, (void)rgb;
  return 0;
}

/* Frames that are not begun, that are begun twice or given up, rows that do not fit, and arguments that are wrong. */
static void misordered(psb_decoder *decoder, const psb_camera *camera) {
  const size_t row_len = (size_t)16 * camera->width_px * 2;
  psb_message message;
  psb_report report = {0};
  psb_pixels piece;
  uint8_t *row = malloc(row_len);
  CHECK(psb_next_tile(decoder, &piece, &report, &message) == PSB_STATUS_MISUSE && strstr(message.text, "psb_begin"));
  CHECK(piece.bytes == NULL && piece.len == 0);
  CHECK(psb_next_tile_row(decoder, row, row_len, &piece, NULL, &message) == PSB_STATUS_MISUSE && strstr(message.text, "psb_begin"));
  CHECK(psb_begin(NULL, camera, PSB_FORMAT_RGB888, &message) == PSB_STATUS_MISUSE);
  CHECK(psb_begin(decoder, NULL, PSB_FORMAT_RGB888, &message) == PSB_STATUS_MISUSE);
  CHECK(psb_begin(decoder, camera, 5, &message) == PSB_STATUS_MISUSE && strstr(message.text, "PSB_FORMAT"));
  CHECK(psb_next_tile(NULL, &piece, NULL, NULL) == PSB_STATUS_MISUSE && psb_next_tile_row(NULL, row, row_len, &piece, NULL, NULL) == PSB_STATUS_MISUSE);
  CHECK(psb_begin(decoder, camera, PSB_FORMAT_RGB565_BIG_ENDIAN, &message) == PSB_STATUS_OK);
  CHECK(psb_next_tile(decoder, NULL, NULL, NULL) == PSB_STATUS_MISUSE);
  CHECK(psb_next_tile_row(decoder, row, row_len, NULL, NULL, NULL) == PSB_STATUS_MISUSE);
  CHECK(psb_next_tile_row(decoder, NULL, row_len, &piece, NULL, &message) == PSB_STATUS_MISUSE);
  CHECK(psb_next_tile_row(decoder, row, row_len - 1, &piece, NULL, &message) == PSB_STATUS_MISUSE && piece.bytes == NULL);
  CHECK(strstr(message.text, "2047") && strstr(message.text, "2048"));
  /* None of these draws anything: the first row is still to come. */
  CHECK(psb_next_tile_row(decoder, row, row_len, &piece, &report, NULL) == PSB_STATUS_OK && piece.bytes == row);
  CHECK(piece.y_px == 0 && piece.width == 64 && piece.height == 16 && piece.len == row_len && report.splats == 0);
  /* A frame that is begun again starts from its first tile. */
  CHECK(psb_begin(decoder, camera, PSB_FORMAT_RGB888, NULL) == PSB_STATUS_OK);
  CHECK(psb_next_tile(decoder, &piece, NULL, NULL) == PSB_STATUS_OK && piece.x_px == 0 && piece.y_px == 0 && piece.len == 768);
  /* psb_render ends it, and so does a psb_begin that fails. */
  CHECK(psb_render(decoder, camera, take, NULL, NULL, NULL) == PSB_STATUS_OK);
  CHECK(psb_next_tile(decoder, &piece, NULL, NULL) == PSB_STATUS_MISUSE && piece.bytes == NULL);
  CHECK(psb_begin(decoder, camera, PSB_FORMAT_RGB888, NULL) == PSB_STATUS_OK);
  CHECK(psb_begin(decoder, camera, 99, NULL) == PSB_STATUS_MISUSE);
  CHECK(psb_next_tile(decoder, &piece, NULL, NULL) == PSB_STATUS_MISUSE);
  /* After the last tile nothing comes, as often as one asks. */
  CHECK(psb_begin(decoder, camera, PSB_FORMAT_RGB565_LITTLE_ENDIAN_DITHERED, NULL) == PSB_STATUS_OK);
  unsigned n_tiles = 0;
  while (psb_next_tile(decoder, &piece, &report, &message) == PSB_STATUS_OK && piece.bytes != NULL) n_tiles++;
  CHECK(n_tiles == 12 && report.splats > 0 && message.text[0] == 0);
  CHECK(psb_next_tile(decoder, &piece, NULL, NULL) == PSB_STATUS_OK && piece.bytes == NULL);
  CHECK(psb_next_tile_row(decoder, row, 0, &piece, NULL, NULL) == PSB_STATUS_OK && piece.bytes == NULL);
  /* Small steps: most show nothing, and what they come to is said in each. */
  uint8_t progress = 99;
  CHECK(psb_advance(decoder, &progress, &piece, NULL, NULL) == PSB_STATUS_OK && progress == PSB_PROGRESS_COMPLETE && piece.bytes == NULL);
  CHECK(psb_begin(decoder, camera, PSB_FORMAT_RGB888, NULL) == PSB_STATUS_OK);
  CHECK(psb_advance(decoder, NULL, &piece, NULL, NULL) == PSB_STATUS_MISUSE && psb_advance(decoder, &progress, NULL, NULL, NULL) == PSB_STATUS_MISUSE);
  CHECK(psb_advance(NULL, &progress, &piece, NULL, NULL) == PSB_STATUS_MISUSE && progress == PSB_PROGRESS_WORKING);
  CHECK(psb_advance(decoder, &progress, &piece, NULL, NULL) == PSB_STATUS_OK && progress == PSB_PROGRESS_WORKING && piece.bytes == NULL);
  unsigned n_steps = 1;
  for (n_tiles = 0; progress != PSB_PROGRESS_COMPLETE && n_steps < 10000; n_steps++) {
    CHECK(psb_advance(decoder, &progress, &piece, &report, &message) == PSB_STATUS_OK);
    CHECK((progress == PSB_PROGRESS_TILE) == (piece.bytes != NULL));
    n_tiles += progress == PSB_PROGRESS_TILE;
  }
  CHECK(n_tiles == 12 && n_steps > 14 && report.splats > 0);
  /* Given up in the middle, and the memory with it. */
  CHECK(psb_begin(decoder, camera, PSB_FORMAT_RGB888, NULL) == PSB_STATUS_OK);
  CHECK(psb_next_tile(decoder, &piece, NULL, NULL) == PSB_STATUS_OK);
  free(row);
}

/* What goes wrong with two painters alone. */
static void misuse_by_two(const uint8_t *bundle, size_t len, psb_budget budget, const psb_camera *camera) {
  psb_plan plan;
  psb_message message;
  void *place = aligned_alloc(PSB_DECODER_ALIGN, PSB_PAIR_BYTES);
  psb_pair *pair = place;
  psb_decoder *decoder = place;
  budget.ram_bytes = 1 << 20;
  budget.slabs = budget.two_painters = 1;
  CHECK(psb_make_plan(bundle, len, &budget, &plan, &message) == PSB_STATUS_MISUSE && strstr(message.text, "slabs needs to be 0"));
  budget.slabs = 0;
  budget.two_painters = 2;
  CHECK(psb_make_plan(bundle, len, &budget, &plan, &message) == PSB_STATUS_MISUSE && strstr(message.text, "two_painters needs to be 0 or 1; found 2"));
  budget.two_painters = 1;
  CHECK(psb_make_plan(bundle, len, &budget, &plan, &message) == PSB_STATUS_OK);
  uint8_t *scratch = malloc(plan.scratch_bytes);
  CHECK(psb_bind(place, PSB_PAIR_BYTES, bundle, len, &budget, scratch, plan.scratch_bytes, NULL, 0, &decoder, &message) == PSB_STATUS_MISUSE);
  CHECK(strstr(message.text, "psb_bind_two") && decoder == NULL);
  CHECK(psb_pair_bytes() <= PSB_PAIR_BYTES);
  CHECK(psb_bind_two(place, psb_pair_bytes() - 1, bundle, len, &budget, scratch, plan.scratch_bytes, NULL, 0, &pair, &message) == PSB_STATUS_MISUSE);
  CHECK(strstr(message.text, "psb_pair_bytes") && pair == NULL);
  CHECK(psb_bind_two(place, PSB_PAIR_BYTES, bundle, len, &budget, scratch, plan.scratch_bytes, NULL, 0, NULL, &message) == PSB_STATUS_MISUSE);
  budget.two_painters = 0;
  CHECK(psb_bind_two(place, PSB_PAIR_BYTES, bundle, len, &budget, scratch, plan.scratch_bytes, NULL, 0, &pair, &message) == PSB_STATUS_MISUSE);
  CHECK(strstr(message.text, "two_painters needs to be 1"));
  budget.two_painters = 1;
  CHECK(psb_bind_two(place, psb_pair_bytes(), bundle, len, &budget, scratch, plan.scratch_bytes, NULL, 0, &pair, &message) == PSB_STATUS_OK);
  CHECK(psb_render_by_two(NULL, camera, take, NULL, NULL, do_both, NULL, NULL, NULL) == PSB_STATUS_MISUSE);
  CHECK(psb_render_by_two(pair, NULL, take, NULL, NULL, do_both, NULL, NULL, NULL) == PSB_STATUS_MISUSE);
  CHECK(psb_render_by_two(pair, camera, NULL, NULL, NULL, do_both, NULL, NULL, NULL) == PSB_STATUS_MISUSE);
  CHECK(psb_render_by_two(pair, camera, take, NULL, NULL, NULL, NULL, NULL, &message) == PSB_STATUS_MISUSE && strcmp(message.text, "join is NULL") == 0);
  /* Either task, while splats are gathered and while they are blended. */
  for (int i = 0; i < 4; i++) {
    struct undone undone = {i / 2, i % 2};
    CHECK(psb_render_by_two(pair, camera, take, NULL, NULL, do_one, &undone, NULL, &message) == PSB_STATUS_MISUSE && strstr(message.text, "undone"));
  }
  /* A display of either core that refuses its second tile. */
  for (int other = 0; other < 2; other++) {
    int32_t refused = 0, taken = 100;
    int32_t *here = other ? &taken : &refused, *there = other ? &refused : &taken;
    CHECK(psb_render_by_two(pair, camera, refuse, here, there, do_both, NULL, NULL, &message) == PSB_STATUS_STOPPED);
    CHECK(refused == 2 && taken > 100 && strstr(message.text, "returned 77"));
  }
  int32_t n_here = 0, n_there = 0;
  CHECK(psb_render_by_two(pair, camera, count, &n_here, &n_there, do_twice, NULL, NULL, &message) == PSB_STATUS_OK);
  CHECK(n_here + n_there == 12 && n_here > 0 && n_there > 0);
  free(scratch);
  free(place);
}

/* Every argument that may be wrong, and damaged bytes, each in memory of its own so that the sanitiser sees a byte too many. */
static void misuse(const uint8_t *bundle, size_t len) {
  psb_budget budget = psb_budget_for_frame(64, 48, 1 << 20);
  psb_plan plan;
  psb_message message;
  psb_decoder *decoder = NULL;
  psb_camera camera;
  psb_report report;
  void *place = aligned_alloc(PSB_DECODER_ALIGN, PSB_DECODER_BYTES);
  CHECK(psb_make_plan(NULL, len, &budget, &plan, &message) == PSB_STATUS_MISUSE);
  CHECK(strcmp(message.text, "bundle is NULL") == 0);
  CHECK(psb_make_plan(bundle, len, NULL, &plan, NULL) == PSB_STATUS_MISUSE);
  CHECK(psb_make_plan(bundle, len, &budget, NULL, &message) == PSB_STATUS_MISUSE);
  budget.quality = 9;
  CHECK(psb_make_plan(bundle, len, &budget, &plan, &message) == PSB_STATUS_MISUSE && strstr(message.text, "PSB_QUALITY"));
  budget.quality = PSB_QUALITY_EXACT;
  budget.slabs = 2;
  CHECK(psb_make_plan(bundle, len, &budget, &plan, &message) == PSB_STATUS_MISUSE && strcmp(message.text, "slabs needs to be 0 or 1; found 2") == 0);
  memset(&budget.slabs, 0xFF, sizeof budget.slabs);
  CHECK(psb_make_plan(bundle, len, &budget, &plan, NULL) == PSB_STATUS_MISUSE);
  budget.slabs = 0;
  /* A budget of zeros draws nothing, and says so. */
  budget.tiers = 0;
  CHECK(psb_make_plan(bundle, len, &budget, &plan, &message) == PSB_STATUS_MISUSE && strstr(message.text, "tiers to draw is 0"));
  budget.tiers = 255;
  budget.ram_bytes = 100;
  CHECK(psb_make_plan(bundle, len, &budget, &plan, &message) == PSB_STATUS_OVER_BUDGET && plan.scratch_bytes > 100);
  budget.ram_bytes = plan.scratch_bytes;
  CHECK(psb_make_plan(bundle, len, &budget, &plan, &message) == PSB_STATUS_OK && message.text[0] == 0);
  uint8_t *scratch = malloc(plan.scratch_bytes);
  /* A frame that takes more work than the budget allows ends, and says what it took. */
  budget.most_work = 100000;
  CHECK(psb_bind(place, PSB_DECODER_BYTES, bundle, len, &budget, scratch, plan.scratch_bytes, NULL, 0, &decoder, &message) == PSB_STATUS_OK);
  CHECK(psb_preview(bundle, len, 64, 48, &camera, &message) == PSB_STATUS_OK);
  CHECK(psb_render(decoder, &camera, take, NULL, NULL, &message) == PSB_STATUS_OVER_BUDGET && strstr(message.text, "budget has 97"));
  budget.most_work = UINT64_MAX;
  CHECK(psb_bind(NULL, PSB_DECODER_BYTES, bundle, len, &budget, scratch, plan.scratch_bytes, NULL, 0, &decoder, &message) == PSB_STATUS_MISUSE);
  CHECK(psb_decoder_bytes() <= PSB_DECODER_BYTES);
  CHECK(psb_bind(place, psb_decoder_bytes() - 1, bundle, len, &budget, scratch, plan.scratch_bytes, NULL, 0, &decoder, &message) == PSB_STATUS_MISUSE);
  CHECK(psb_bind((char *)place + 1, PSB_DECODER_BYTES - 1, bundle, len, &budget, scratch, plan.scratch_bytes, NULL, 0, &decoder, &message) == PSB_STATUS_MISUSE);
  CHECK(psb_bind(place, PSB_DECODER_BYTES, bundle, len, &budget, NULL, plan.scratch_bytes, NULL, 0, &decoder, &message) == PSB_STATUS_MISUSE);
  const psb_budget one_region = budget;
  budget.ram_bytes = plan.scratch_bytes / 2;
  budget.slow_bytes = 1;
  CHECK(psb_make_plan(bundle, len, &budget, &plan, &message) == PSB_STATUS_OVER_BUDGET && plan.slow_scratch_bytes > 1);
  budget.slow_bytes = plan.slow_scratch_bytes;
  CHECK(psb_make_plan(bundle, len, &budget, &plan, NULL) == PSB_STATUS_OK && plan.slow_scratch_bytes > 0);
  CHECK(psb_bind(place, PSB_DECODER_BYTES, bundle, len, &budget, scratch, plan.scratch_bytes, NULL, 0, &decoder, &message) == PSB_STATUS_MISUSE);
  CHECK(strstr(message.text, "slow is NULL"));
  budget = one_region;
  CHECK(psb_make_plan(bundle, len, &budget, &plan, NULL) == PSB_STATUS_OK);
  CHECK(psb_bind(place, PSB_DECODER_BYTES, bundle, len, &budget, scratch, plan.scratch_bytes, NULL, 0, NULL, &message) == PSB_STATUS_MISUSE);
  for (size_t cut = 0; cut < len; cut += 97) {
    uint8_t *part = malloc(cut + 1);
    memcpy(part, bundle, cut);
    /* A file that is cut where a tier ends is a smaller scene; anywhere else it is refused. */
    psb_status status = psb_make_plan(part, cut, &budget, &plan, &message);
    CHECK(status == PSB_STATUS_OK || (status == PSB_STATUS_MALFORMED && message.text[0]));
    part[cut / 2] ^= 16;
    status = psb_make_plan(part, cut, &budget, &plan, NULL);
    CHECK(status <= PSB_STATUS_OVER_BUDGET);
    free(part);
  }
  CHECK(psb_make_plan(bundle, len, &budget, &plan, NULL) == PSB_STATUS_OK);
  CHECK(psb_bind(place, PSB_DECODER_BYTES, bundle, len, &budget, scratch, plan.scratch_bytes, NULL, 0, &decoder, NULL) == PSB_STATUS_OK);
  CHECK(psb_preview(NULL, len, 64, 48, &camera, NULL) == PSB_STATUS_MISUSE);
  CHECK(psb_preview(bundle, len, 64, 48, NULL, NULL) == PSB_STATUS_MISUSE);
  CHECK(psb_preview(bundle, len, 0, 48, &camera, NULL) == PSB_STATUS_MISUSE);
  CHECK(psb_preview(bundle, len, 64, 48, &camera, &message) == PSB_STATUS_OK && camera.width_px == 64);
  CHECK(psb_render(decoder, &camera, NULL, NULL, &report, &message) == PSB_STATUS_MISUSE);
  CHECK(psb_render(decoder, NULL, refuse, NULL, &report, &message) == PSB_STATUS_MISUSE);
  int32_t n_tiles = 0;
  CHECK(psb_render(decoder, &camera, refuse, &n_tiles, &report, &message) == PSB_STATUS_STOPPED);
  CHECK(n_tiles == 2 && strstr(message.text, "returned 77"));
  CHECK(psb_render(decoder, &camera, refuse, &n_tiles, NULL, NULL) == PSB_STATUS_OK);
  CHECK(psb_orbit(&camera, NAN, &camera, &message) == PSB_STATUS_MISUSE && strstr(message.text, "8192"));
  CHECK(psb_orbit(&camera, -8193.0f, &camera, &message) == PSB_STATUS_MISUSE);
  misordered(decoder, &camera);
  misuse_by_two(bundle, len, budget, &camera);
  camera.rotation[0] += 0.5f;
  CHECK(psb_begin(decoder, &camera, PSB_FORMAT_RGB888, &message) == PSB_STATUS_MISUSE && message.text[0]);
  CHECK(psb_render(decoder, &camera, refuse, &n_tiles, &report, &message) == PSB_STATUS_MISUSE && message.text[0]);
  CHECK(psb_orbit(NULL, 1.0f, &camera, NULL) == PSB_STATUS_MISUSE);
  CHECK(strcmp(psb_status_name(99), "unknown") == 0);
  free(scratch);
  free(place);
}

int main(int argc, char **argv) {
  for (int i = 1; i < argc; i++) {
    char *path = strchr(argv[i], '=');
    CHECK(path != NULL);
    *path++ = 0;
    FILE *file = fopen(path, "rb");
    CHECK(file != NULL && fseek(file, 0, SEEK_END) == 0);
    const size_t len = (size_t)ftell(file);
    uint8_t *bundle = malloc(len);
    rewind(file);
    CHECK(fread(bundle, 1, len, file) == len && fclose(file) == 0);
    if (draw_orbit(argv[i], bundle, len) != 0) return 1;
    misuse(bundle, len);
    free(bundle);
  }
  return 0;
}
