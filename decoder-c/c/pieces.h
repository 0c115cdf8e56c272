/* A frame drawn piece by piece. */
#ifndef PIECES_H
#define PIECES_H

#include "pocketsplat.h"

/* Draws a frame by tiles and by rows of tiles in every format. Sets is_same where each byte is that of frame, width × height × 3, and the report
 * that of expected. */
psb_status draw_in_pieces(psb_decoder *decoder, const psb_camera *camera, const uint8_t *frame, const psb_report *expected,
                          int *is_same, psb_message *message);

#endif
