/* Draws a bundle from four sides into a frame buffer: the whole of what a firmware in C does. */
#include "draw.h"

#include "pieces.h"
#include "pocketsplat.h"

enum { MAX_FRAME_BYTES = 3 * 200 * 200, MAX_SCRATCH_BYTES = 512 * 1024, SIDES = 4 };

/* Everything there is, fixed when the program is linked. */
static uint8_t scratch[MAX_SCRATCH_BYTES];
/* Where a board has slower memory beside its own, such as PSRAM: the linker puts this there. */
static uint8_t slow[MAX_SCRATCH_BYTES];
static uint8_t frame[MAX_FRAME_BYTES];
static _Alignas(PSB_DECODER_ALIGN) uint8_t place[PSB_DECODER_BYTES];
static _Alignas(PSB_DECODER_ALIGN) uint8_t place_of_two[PSB_PAIR_BYTES];
static psb_message message;

/* Copies a tile into the frame buffer; user is the frame's width. A display would get it by its bus. */
static int32_t take_tile(void *user, uint16_t x_px, uint16_t y_px, uint16_t width, uint16_t height, const uint8_t *rgb) {
  const size_t stride = *(const uint16_t *)user;
  for (size_t y = 0; y < height; y++) {
    uint8_t *row = frame + 3 * ((y_px + y) * stride + x_px);
    for (size_t i = 0; i < 3 * (size_t)width; i++) row[i] = rgb[3 * width * y + i];
  }
  return 0;
}

/* CRC-32 (IEEE 802.3). */
static uint32_t crc32(const uint8_t *bytes, size_t len) {
  uint32_t crc = 0xffffffff;
  while (len--) {
    crc ^= *bytes++;
    for (int bit = 0; bit < 8; bit++) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return ~crc;
}

static void say_row(const char *name, unsigned tiers, unsigned side, uint32_t crc) {
  char digits[] = ",0,0,00000000\n";
  digits[1] = (char)('0' + tiers);
  digits[3] = (char)('0' + side);
  for (int i = 0; i < 8; i++) digits[5 + i] = "0123456789abcdef"[crc >> (28 - 4 * i) & 15];
  say(name);
  say(digits);
}

static int failed(psb_status status) {
  say(psb_status_name(status));
  say(": ");
  say(message.text);
  say("\n");
  return 1;
}

/* So that a tile that does not come shows. */
static void clear_frame(void) {
  for (size_t i = 0; i < sizeof frame; i++) frame[i] = 0xA5;
}

/* The same frame with a third of its memory, the rest being slow: 1 if a pixel differs, if a byte fewer of the slow memory is not refused, or
 * if there is no such plan. */
static int differs_in_two_regions(const uint8_t *bundle, size_t bundle_len, psb_budget budget, const psb_camera *camera, size_t whole_bytes,
                                  uint32_t crc) {
  psb_plan plan;
  psb_decoder *decoder;
  budget.ram_bytes = whole_bytes / 3;
  budget.slow_bytes = sizeof slow;
  if (psb_make_plan(bundle, bundle_len, &budget, &plan, &message) != PSB_STATUS_OK || plan.slow_scratch_bytes == 0) return 1;
  if (psb_bind(place, sizeof place, bundle, bundle_len, &budget, scratch, plan.scratch_bytes, slow, plan.slow_scratch_bytes - 1, &decoder,
               &message) != PSB_STATUS_OVER_BUDGET)
    return 1;
  if (psb_bind(place, sizeof place, bundle, bundle_len, &budget, scratch, plan.scratch_bytes, slow, plan.slow_scratch_bytes, &decoder,
               &message) != PSB_STATUS_OK)
    return 1;
  clear_frame();
  if (psb_render(decoder, camera, take_tile, (void *)&camera->width_px, NULL, &message) != PSB_STATUS_OK) return 1;
  return crc32(frame, 3 * (size_t)camera->width_px * camera->height_px) != crc;
}

/* The same frame by two painters: 1 if a pixel or the number of splats differs, if a byte fewer is not refused, or if there is no such plan. */
static int differs_by_two(const uint8_t *bundle, size_t bundle_len, psb_budget budget, const psb_camera *camera, uint32_t n_splats, uint32_t crc) {
  psb_plan plan;
  psb_pair *pair;
  psb_report reports[2];
  void *width = (void *)&camera->width_px;
  budget.slabs = 0;
  budget.two_painters = 1;
  if (psb_make_plan(bundle, bundle_len, &budget, &plan, &message) != PSB_STATUS_OK) return 1;
  if (psb_bind_two(place_of_two, sizeof place_of_two, bundle, bundle_len, &budget, scratch, plan.scratch_bytes - 1, NULL, 0, &pair, &message) !=
      PSB_STATUS_OVER_BUDGET)
    return 1;
  if (psb_bind_two(place_of_two, sizeof place_of_two, bundle, bundle_len, &budget, scratch, plan.scratch_bytes, NULL, 0, &pair, &message) != PSB_STATUS_OK)
    return 1;
  clear_frame();
  if (psb_render_by_two(pair, camera, take_tile, width, width, do_both, NULL, reports, &message) != PSB_STATUS_OK) return 1;
  if (!reports[0].splats || !reports[1].splats || reports[0].splats + reports[1].splats != n_splats) return 1;
  return crc32(frame, 3 * (size_t)camera->width_px * camera->height_px) != crc;
}

int draw_orbit(const char *name, const uint8_t *bundle, size_t bundle_len) {
  psb_budget budget;
  psb_plan whole, plan;
  psb_decoder *decoder;
  psb_camera preview, camera;
  psb_report report;
  uint32_t crc = 0;
  int is_same;
  psb_status status = psb_preview(bundle, bundle_len, 0, 0, &preview, &message);
  if (status != PSB_STATUS_OK || 3 * (size_t)preview.width_px * preview.height_px > sizeof frame) return failed(status);
  budget = psb_budget_for_frame(preview.width_px, preview.height_px, sizeof scratch);
  status = psb_make_plan(bundle, bundle_len, &budget, &whole, &message);
  if (status != PSB_STATUS_OK) return failed(status);
  for (uint8_t tiers = 1; tiers <= whole.n_tiers; tiers++) {
    budget.tiers = tiers;
    budget.slabs = 1;
    status = psb_make_plan(bundle, bundle_len, &budget, &plan, &message);
    if (status != PSB_STATUS_OK) return failed(status);
    /* One byte fewer is refused, with the number that would do. */
    status = psb_bind(place, sizeof place, bundle, bundle_len, &budget, scratch, plan.scratch_bytes - 1, NULL, 0, &decoder, &message);
    if (status != PSB_STATUS_OVER_BUDGET || decoder != NULL) return failed(status);
    status = psb_bind(place, sizeof place, bundle, bundle_len, &budget, scratch, plan.scratch_bytes, NULL, 0, &decoder, &message);
    if (status != PSB_STATUS_OK) return failed(status);
    for (unsigned side = 0; side < SIDES; side++) {
      status = psb_orbit(&preview, 6.2831855f * (float)side / 4.0f, &camera, &message);
      if (status != PSB_STATUS_OK) return failed(status);
      clear_frame();
      status = psb_render(decoder, &camera, take_tile, &camera.width_px, &report, &message);
      if (status != PSB_STATUS_OK || report.splats == 0) return failed(status);
      /* Piece by piece the same pixels come. */
      status = draw_in_pieces(decoder, &camera, frame, &report, &is_same, &message);
      if (status != PSB_STATUS_OK) return failed(status);
      if (!is_same) {
        say("the pieces of a frame are not the frame\n");
        return 1;
      }
      crc = crc32(frame, 3 * (size_t)camera.width_px * camera.height_px);
      say_row(name, tiers, side, crc);
    }
    if (differs_by_two(bundle, bundle_len, budget, &camera, report.splats, crc)) {
      say("two painters do not draw the frame: ");
      say(message.text);
      say("\n");
      return 1;
    }
    if (differs_in_two_regions(bundle, bundle_len, budget, &camera, plan.scratch_bytes, crc)) {
      say("memory in two regions does not draw the frame: ");
      say(message.text);
      say("\n");
      return 1;
    }
  }
  return 0;
}
