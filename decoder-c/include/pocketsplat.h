/* pocketsplat: draws a compressed neural Gaussian-splat scene without an allocator, in memory that is known beforehand.
 *
 * Written by `cargo test` from src/: change that, and run `POCKETSPLAT_BLESS=1 cargo test`.
 */

#ifndef POCKETSPLAT_H
#define POCKETSPLAT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Bytes that suffice for a psb_decoder on every target.
#define PSB_DECODER_BYTES 3328

// Alignment that suffices for a psb_decoder on every target.
#define PSB_DECODER_ALIGN 8

// Bytes that suffice for a psb_pair on every target.
#define PSB_PAIR_BYTES 4096

// How a call ended, and whose fault it is if not well.
typedef enum psb_status {
  // Done.
  PSB_STATUS_OK = 0,
  // The bytes are not a sound bundle: fetch or flash them again.
  PSB_STATUS_MALFORMED = 1,
  // A sound bundle that needs a newer or a fuller decoder.
  PSB_STATUS_UNSUPPORTED = 2,
  // The memory given is not enough; the message names the bytes that would do.
  PSB_STATUS_OVER_BUDGET = 3,
  // An argument is NULL where it must not be, or outside its limits.
  PSB_STATUS_MISUSE = 4,
  // The caller's function stopped the frame.
  PSB_STATUS_STOPPED = 5,
  // A mistake in pocketsplat; please report it.
  PSB_STATUS_INTERNAL = 6,
} psb_status;

// How exactly a frame is drawn.
typedef enum psb_quality {
  // Every splat, wherever it shows.
  PSB_QUALITY_EXACT = 0,
  // Fewer instructions, and differences that photographs hardly tell.
  PSB_QUALITY_BALANCED = 1,
  // Fewer still; fine detail is left out.
  PSB_QUALITY_DRAFT = 2,
} psb_quality;

// What the bytes of a pixel are.
typedef enum psb_format {
  // Three bytes: red, green, blue.
  PSB_FORMAT_RGB888 = 0,
  // Two bytes, the one with red first: five bits of red, six of green, five of blue, each the nearest. What displays on SPI take.
  PSB_FORMAT_RGB565_BIG_ENDIAN = 1,
  // The same, the byte with blue first. What LCD controllers read from memory.
  PSB_FORMAT_RGB565_LITTLE_ENDIAN = 2,
  // As PSB_FORMAT_RGB565_BIG_ENDIAN, by a 4×4 ordered pattern (Bayer 1973), which turns bands into a fine pattern.
  PSB_FORMAT_RGB565_BIG_ENDIAN_DITHERED = 3,
  // As PSB_FORMAT_RGB565_LITTLE_ENDIAN, by the same pattern.
  PSB_FORMAT_RGB565_LITTLE_ENDIAN_DITHERED = 4,
} psb_format;

// What a call of psb_advance came to.
typedef enum psb_progress {
  // Nothing to show yet.
  PSB_PROGRESS_WORKING = 0,
  // The next tile.
  PSB_PROGRESS_TILE = 1,
  // The frame is complete.
  PSB_PROGRESS_COMPLETE = 2,
} psb_progress;

// A decoder that is bound to a bundle and to its scratch memory. It lies in memory of the caller, has nothing to free, and may be
// forgotten at any time; its scratch memory is then the caller's again.
typedef struct psb_decoder psb_decoder;

// Two decoders that draw frames of one scene together, bound by psb_bind_two. They lie in memory of the caller, have nothing to free, and may be
// forgotten at any time; their scratch memory is then the caller's again.
typedef struct psb_pair psb_pair;

// What there is to draw with. Begin with psb_budget_for_frame.
typedef struct psb_budget {
  // The most that a frame may take, model instructions: about as many as a Cortex-M4 executes. A frame that takes more ends with
  // PSB_STATUS_OVER_BUDGET. UINT64_MAX for no limit.
  uint64_t most_work;
  // Bytes of scratch memory that there are.
  size_t ram_bytes;
  // Bytes of slower memory beside it, such as PSRAM or SDRAM; 0 where there is none. It has to be normal memory: where it is Device memory
  // after reset, as SDRAM at 0xC0000000 is, have the MPU make it normal, or a Cortex-M7 faults.
  size_t slow_bytes;
  // Widest frame, pixels.
  uint16_t width_px;
  // Highest frame, pixels.
  uint16_t height_px;
  // Tiers to draw at most, 1 or more; 255 draws all that the file holds.
  uint8_t tiers;
  // A psb_quality.
  uint8_t quality;
  // 1 to draw strips with too many splats in slabs of depth, which takes longer; 0 to leave splats out.
  uint8_t slabs;
  // 1 to draw on two cores, by psb_bind_two: in a single strip, without slabs. 0 to draw on one core.
  uint8_t two_painters;
} psb_budget;

// What fits into a budget.
typedef struct psb_plan {
  // Bytes of scratch memory that psb_bind or psb_bind_two takes; where nothing fits, those that would do.
  size_t scratch_bytes;
  // Bytes of slower memory that the same call takes beside them, 0 where everything lies in the first; where nothing fits and there is
  // slower memory, those that would do.
  size_t slow_scratch_bytes;
  // Share of the anchors that is not drawn.
  float pruning_rate;
  // Places for splats, on two cores for each.
  uint32_t max_splats;
  // Tiers that are drawn.
  uint8_t n_tiers;
  // Horizontal strips of a frame.
  uint8_t n_strips;
  // Anchors are decoded once, not in every frame.
  bool is_resident;
  // Gaussians are evaluated once, not in every frame.
  bool is_baked;
} psb_plan;

// What was wrong, for people: the place, the number found and the number needed. Longer texts are cut.
typedef struct psb_message {
  // Ends with NUL.
  char text[192];
} psb_message;

// A pinhole camera in the frame of a bundle: x right, y down, z forward (OpenCV).
//
// A point p of the scene is at (x, y, z) = R·p + t for the camera and at u = fx·x/z + cx, v = fy·y/z + cy on its image; the centre of
// pixel (i, j) is at (i + 0.5, j + 0.5).
typedef struct psb_camera {
  // R, row by row: scene to camera.
  float rotation[9];
  // t, units of the scene.
  float translation[3];
  // fx, fy, pixels.
  float focal_px[2];
  // cx, cy, pixels from the outer corner of the first pixel.
  float principal_px[2];
  // Frame width, pixels.
  uint16_t width_px;
  // Frame height, pixels.
  uint16_t height_px;
} psb_camera;

// Takes one tile of a frame: 8-bit RGB, row by row, width × height pixels, at (x_px, y_px). What is not 0 ends the frame.
typedef int32_t (*psb_tile)(void *user,
                            uint16_t x_px,
                            uint16_t y_px,
                            uint16_t width,
                            uint16_t height,
                            const uint8_t *rgb);

// What a frame consisted of.
typedef struct psb_report {
  // Anchors that were decoded for this frame.
  uint32_t anchors_decoded;
  // Anchors whose heads ran.
  uint32_t anchors_visible;
  // Splats drawn.
  uint32_t splats;
  // Splats left out because there was no memory for them.
  uint32_t splats_dropped;
  // Pairs of a pixel and a splat evaluated for it.
  uint32_t pixel_splats;
  // Bytes of the scratch memory that this frame needed.
  uint32_t scratch_used;
} psb_report;

// A finished part of a frame: a tile, or a row of tiles.
typedef struct psb_pixels {
  // Row by row, width × height pixels; NULL when the frame is complete.
  const uint8_t *bytes;
  // Bytes of them.
  size_t len;
  // First column, pixels.
  uint16_t x_px;
  // First row, pixels.
  uint16_t y_px;
  // Width, pixels.
  uint16_t width;
  // Height, pixels.
  uint16_t height;
} psb_pixels;

// What one core is to do: call run with state, once.
typedef struct psb_task {
  // Does it.
  void (*run)(void *state);
  // What run takes.
  void *state;
} psb_task;

// Does both tasks at the same time, here on the core that calls and there on the other, and returns when both are done. A task has to
// see what was written before it, and the core that goes on what the task wrote: with barriers where the cores need them.
typedef void (*psb_join)(void *user, struct psb_task here, struct psb_task there);

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The name of a status, such as "over budget"; "unknown" for other numbers. Static, ends with NUL.
const char *psb_status_name(uint32_t status);

// A budget for frames of at most width_px by height_px within ram_bytes, everything else as good as memory allows.
struct psb_budget psb_budget_for_frame(uint16_t width_px, uint16_t height_px, size_t ram_bytes);

// Checks a bundle and says how many bytes the best plan within a budget takes, on two cores both together.
//
// bundle: bundle_len bytes of a .psb. message: NULL, or where to say what was wrong.
//
// # Safety
// Pointers are NULL or point to what the call says.
enum psb_status psb_make_plan(const uint8_t *bundle,
                              size_t bundle_len,
                              const struct psb_budget *budget,
                              struct psb_plan *plan,
                              struct psb_message *message);

// The bundle's own camera, with which a device may begin: for frames of width_px by height_px, or of its own size for 0 by 0.
//
// Other proportions than its own stretch the picture.
//
// bundle: bundle_len bytes of a .psb, which are checked. message: NULL, or where to say what was wrong.
//
// # Safety
// Pointers are NULL or point to what the call says.
enum psb_status psb_preview(const uint8_t *bundle,
                            size_t bundle_len,
                            uint16_t width_px,
                            uint16_t height_px,
                            struct psb_camera *camera,
                            struct psb_message *message);

// Carries a camera by an angle, radians, at most 8192 in size, around the upright axis through what it looks at.
//
// turned may be camera itself. message: NULL, or where to say what was wrong.
//
// # Safety
// Pointers are NULL or point to what the call says.
enum psb_status psb_orbit(const struct psb_camera *camera,
                          float angle,
                          struct psb_camera *turned,
                          struct psb_message *message);

// Bytes of a psb_decoder on this target, PSB_DECODER_BYTES at most; its alignment is PSB_DECODER_ALIGN at most.
size_t psb_decoder_bytes(void);

// Checks a bundle, plans for it, and binds a decoder to it.
//
// place: place_len bytes for the decoder, psb_decoder_bytes() or PSB_DECODER_BYTES, aligned to PSB_DECODER_ALIGN. scratch: scratch_len bytes of any
// alignment, as many as psb_make_plan said or more. slow: likewise slow_len bytes of slower memory; NULL where slow_scratch_bytes of the plan is
// 0. budget: with two_painters 0. decoder: gets the decoder, NULL where the call fails. message: NULL, or where to say what was wrong.
//
// # Safety
// Pointers are NULL or point to what the call says. Bundle, place, scratch and slow lie apart, stay where they are, and nobody else writes
// to them as long as the decoder is used.
enum psb_status psb_bind(void *place,
                         size_t place_len,
                         const uint8_t *bundle,
                         size_t bundle_len,
                         const struct psb_budget *budget,
                         uint8_t *scratch,
                         size_t scratch_len,
                         uint8_t *slow,
                         size_t slow_len,
                         struct psb_decoder **decoder,
                         struct psb_message *message);

// Draws the scene as a camera sees it and hands it to a function tile by tile.
//
// user: passed on to tile. report: NULL, or where to say what the frame consisted of. message: NULL, or where to say what was wrong. After an
// error the next frame is drawn as if nothing had been. psb_begin draws the same frame piece by piece.
//
// # Safety
// Pointers are NULL or point to what the call says; the decoder is bound, and the function does not use it.
enum psb_status psb_render(struct psb_decoder *decoder,
                           const struct psb_camera *camera,
                           psb_tile tile,
                           void *user,
                           struct psb_report *report,
                           struct psb_message *message);

// Begins a frame whose pixels come when they are asked for, by psb_next_tile or psb_next_tile_row: the same as psb_render's.
//
// format: a psb_format. message: NULL, or where to say what was wrong. A frame that was begun before, and is not complete, ends here without
// harm; psb_render ends it too.
//
// # Safety
// Pointers are NULL or point to what the call says; the decoder is bound.
enum psb_status psb_begin(struct psb_decoder *decoder,
                          const struct psb_camera *camera,
                          uint32_t format,
                          struct psb_message *message);

// Draws the next tile of the frame that was begun: 16 by 16 pixels, less at the right and at the bottom; in rows from the top, each from the left.
//
// tile: gets the tile; its bytes are NULL when the frame is complete. They lie in scratch memory and stay until the next call with this decoder.
// report: NULL, or where to say, when the frame is complete, what it consisted of. message: NULL, or where to say what was wrong;
// PSB_STATUS_MISUSE when no frame is begun.
//
// # Safety
// Pointers are NULL or point to what the call says; the decoder is bound.
enum psb_status psb_next_tile(struct psb_decoder *decoder,
                              struct psb_pixels *tile,
                              struct psb_report *report,
                              struct psb_message *message);

// Does a small part of the frame that was begun: a few anchors, a part of the sort of a strip, or a few splats of a tile. Between two calls the processor
// is free, for a watchdog, USB or another task; psb_next_tile does as many at once as a tile takes.
//
// progress: gets a psb_progress, PSB_PROGRESS_WORKING with every error. tile: gets the tile, as psb_next_tile gives it; NULL there unless progress is PSB_PROGRESS_TILE.
// report: NULL, or where to say, when the frame is complete, what it consisted of. message: NULL, or where to say what was wrong;
// PSB_STATUS_MISUSE when no frame is begun.
//
// # Safety
// Pointers are NULL or point to what the call says; the decoder is bound.
enum psb_status psb_advance(struct psb_decoder *decoder,
                            uint8_t *progress,
                            struct psb_pixels *tile,
                            struct psb_report *report,
                            struct psb_message *message);

// Draws the next row of tiles into memory of the caller, so that one transfer sends 16 whole lines of the frame, fewer at the bottom. After
// single tiles of a row it draws the rest of the row.
//
// bytes: len bytes; 16 × width of the frame × bytes of a pixel serve every row. Too few are PSB_STATUS_MISUSE and the message names those needed;
// the row can be asked for again. row: gets the row, in bytes; NULL there when the frame is complete. report: NULL, or where to say, when the
// frame is complete, what it consisted of. message: NULL, or where to say what was wrong; PSB_STATUS_MISUSE when no frame is begun.
//
// With two such pieces of memory the bus sends one while the next call fills the other.
//
// # Safety
// Pointers are NULL or point to what the call says; the decoder is bound, and bytes lie apart from its memory.
enum psb_status psb_next_tile_row(struct psb_decoder *decoder,
                                  uint8_t *bytes,
                                  size_t len,
                                  struct psb_pixels *row,
                                  struct psb_report *report,
                                  struct psb_message *message);

// Bytes of a psb_pair on this target, PSB_PAIR_BYTES at most; its alignment is PSB_DECODER_ALIGN at most.
size_t psb_pair_bytes(void);

// Checks a bundle, plans for it, and binds two decoders to it, which draw frames together by psb_render_by_two.
//
// place: place_len bytes for both, psb_pair_bytes() or PSB_PAIR_BYTES, aligned to PSB_DECODER_ALIGN. budget: with two_painters 1. pair: gets them, NULL
// where the call fails. The rest as psb_bind has it.
//
// # Safety
// As for psb_bind.
enum psb_status psb_bind_two(void *place,
                             size_t place_len,
                             const uint8_t *bundle,
                             size_t bundle_len,
                             const struct psb_budget *budget,
                             uint8_t *scratch,
                             size_t scratch_len,
                             uint8_t *slow,
                             size_t slow_len,
                             struct psb_pair **pair,
                             struct psb_message *message);

// Draws the scene as a camera sees it on two cores: the same pixels as psb_render.
//
// tile: is called on both cores, with here_user on this one and there_user on the other; each tile comes once. Where it does not return 0, its core
// draws no more; the other one finishes its part. join: does two tasks at the same time, see psb_join; a frame calls it twice at most. join_user: passed on to
// it. reports: NULL, or two, where to say what each core did; scratch_used of either is that of both. message: NULL, or where to say what was wrong. After
// an error the next frame is drawn as if nothing had been.
//
// # Safety
// Pointers are NULL or point to what the call says; the pair is bound, and neither function uses it. join runs each task on one core at a time,
// returns only when both have ended, and runs none after that.
enum psb_status psb_render_by_two(struct psb_pair *pair,
                                  const struct psb_camera *camera,
                                  psb_tile tile,
                                  void *here_user,
                                  void *there_user,
                                  psb_join join,
                                  void *join_user,
                                  struct psb_report *reports,
                                  struct psb_message *message);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* POCKETSPLAT_H */
