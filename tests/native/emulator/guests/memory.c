// Takes all memory there is, gives it back, takes it in one piece.
#define DEBUG
#include <debug.h>
#include <kilolib.h>
#include <stdlib.h>
#include <string.h>

enum { PIECES = 160, BYTES = 40 };

static void *piece[PIECES];

// Compilers know malloc and leave out what is not used: what goes through here is used.
static void *volatile last;

static int got(void *memory) {
    last = memory;
    return last != NULL;
}

static int take_all(void) {
    int count = 0;
    while (count < PIECES && (piece[count] = malloc(BYTES)) != NULL) {
        memset(piece[count], kilo_uid + count, BYTES);
        count++;
    }
    return count;
}

static int spoilt(int count) {
    int wrong = 0;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < BYTES; k++)
            wrong += ((uint8_t *)piece[i])[k] != (uint8_t)(kilo_uid + i);
    return wrong;
}

static void setup(void) {
    int count = take_all();
    printf("pieces %d", count);
    delay(1000);  // the other robots take theirs meanwhile
    printf("spoilt %d", spoilt(count));

    for (int i = 0; i < count; i += 2) free(piece[i]);
    printf("hole %d", got(malloc(3 * BYTES)));
    for (int i = 1; i < count; i += 2) free(piece[i]);
    printf("joined %d", got(malloc(4800)));
    free(last);
    free(NULL);

    uint8_t *zeros = calloc(100, 5);
    int sum = 0;
    for (int i = 0; i < 500; i++) sum += zeros[i];
    printf("calloc %d, %d", sum, got(calloc(30000, 30000)));
    strcpy((char *)zeros, "kept");
    char *larger = realloc(zeros, 700);
    printf("realloc %s, %d", larger, got(realloc(larger, 20000)));
    printf("aligned %d", (int)((uintptr_t)larger % 8));
    printf("too much %d %d", got(malloc(6145)), got(malloc((size_t)-1)));
    printf("nothing %d", got(malloc(0)));
}

static void loop(void) {}

int main(void) {
    kilo_init();
    kilo_start(setup, loop);
    return 0;
}
