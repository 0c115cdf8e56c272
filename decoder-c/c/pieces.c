/* Draws a frame piece by piece, as a firmware does that keeps its bus busy, and compares every byte with the frame of psb_render. */
#include "pieces.h"

enum { MAX_WIDTH_PX = 200, FORMATS = 5 };

/* Two rows of tiles by turns: a bus would send one while the next is drawn into the other. */
static uint8_t rows[2][3 * 16 * MAX_WIDTH_PX];

/* The nearest of the steps 0 to most. */
static unsigned nearest(unsigned byte, unsigned most) { return (byte * most + 127) / 255; }

/* Whether a piece holds the pixels of the frame; of a dithered one, whether each channel is at most one step away. */
static int matches(const psb_pixels *piece, uint32_t format, const uint8_t *frame, size_t stride) {
  const size_t n_bytes = format == PSB_FORMAT_RGB888 ? 3 : 2;
  const int is_dithered = format >= PSB_FORMAT_RGB565_BIG_ENDIAN_DITHERED;
  const int is_big = format == PSB_FORMAT_RGB565_BIG_ENDIAN || format == PSB_FORMAT_RGB565_BIG_ENDIAN_DITHERED;
  const uint8_t *found = piece->bytes;
  if (piece->len != n_bytes * piece->width * piece->height) return 0;
  for (size_t y = 0; y < piece->height; y++) {
    for (size_t x = 0; x < piece->width; x++, found += n_bytes) {
      const uint8_t *rgb = frame + 3 * ((piece->y_px + y) * stride + piece->x_px + x);
      if (format == PSB_FORMAT_RGB888) {
        if (found[0] != rgb[0] || found[1] != rgb[1] || found[2] != rgb[2]) return 0;
        continue;
      }
      const unsigned pixel = is_big ? found[0] << 8 | found[1] : found[1] << 8 | found[0];
      const unsigned steps[3] = {pixel >> 11, pixel >> 5 & 63, pixel & 31}, most[3] = {31, 63, 31};
      for (int i = 0; i < 3; i++) {
        const unsigned near = nearest(rgb[i], most[i]);
        if (is_dithered ? steps[i] + 1 < near || near + 1 < steps[i] : steps[i] != near) return 0;
      }
    }
  }
  return 1;
}

/* The next tile by small steps, as psb_next_tile gives it. */
static psb_status next_tile_by_steps(psb_decoder *decoder, psb_pixels *tile, psb_report *report, psb_message *message) {
  uint8_t progress = PSB_PROGRESS_WORKING;
  psb_status status = PSB_STATUS_OK;
  while (status == PSB_STATUS_OK && progress == PSB_PROGRESS_WORKING) status = psb_advance(decoder, &progress, tile, report, message);
  return status;
}

/* A whole frame in one format: so many single tiles and then a row, over and over; without rows for 255. Every third single tile comes by
 * small steps. */
static psb_status draw(psb_decoder *decoder, const psb_camera *camera, uint32_t format, unsigned n_single, const uint8_t *frame,
                       int *is_same, psb_report *report, psb_message *message) {
  const size_t bytes_per_pixel = format == PSB_FORMAT_RGB888 ? 3 : 2;
  size_t n_bytes = 0;
  psb_pixels piece;
  psb_status status = psb_begin(decoder, camera, format, message);
  for (unsigned turn = 0; status == PSB_STATUS_OK; turn++) {
    if (n_single == 255 || turn % (n_single + 1) < n_single) {
      status = (turn % 3 ? psb_next_tile : next_tile_by_steps)(decoder, &piece, report, message);
    } else {
      uint8_t *row = rows[turn % 2];
      status = psb_next_tile_row(decoder, row, bytes_per_pixel * 16 * camera->width_px, &piece, report, message);
      if (status == PSB_STATUS_OK && piece.bytes != NULL && piece.bytes != row) *is_same = 0;
    }
    if (status != PSB_STATUS_OK || piece.bytes == NULL) break;
    if (!matches(&piece, format, frame, camera->width_px)) *is_same = 0;
    n_bytes += piece.len;
  }
  if (n_bytes != bytes_per_pixel * camera->width_px * camera->height_px) *is_same = 0;
  return status;
}

psb_status draw_in_pieces(psb_decoder *decoder, const psb_camera *camera, const uint8_t *frame, const psb_report *expected,
                          int *is_same, psb_message *message) {
  /* By tiles, by rows, and by rows whose first tile comes alone. */
  static const unsigned singles[3] = {255, 0, 1};
  *is_same = camera->width_px <= MAX_WIDTH_PX;
  for (uint32_t format = 0; *is_same && format < FORMATS; format++) {
    psb_report report = {0};
    const psb_status status = draw(decoder, camera, format, singles[format % 3], frame, is_same, &report, message);
    if (status != PSB_STATUS_OK) return status;
    if (report.splats != expected->splats || report.pixel_splats != expected->pixel_splats) *is_same = 0;
  }
  return PSB_STATUS_OK;
}
