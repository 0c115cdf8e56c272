/* What the host's test and the example of the board share. */
#ifndef DRAW_H
#define DRAW_H

#include <stddef.h>
#include <stdint.h>

#include "pocketsplat.h"

/* Prints a line of `tests/golden/frames.csv` for each tier of a bundle and each of four sides; 0 when all were drawn. */
int draw_orbit(const char *name, const uint8_t *bundle, size_t bundle_len);

/* What the platform brings: prints text. */
void say(const char *text);

/* The same: does two tasks, on two cores where there are two. */
void do_both(void *user, psb_task here, psb_task there);

#endif
