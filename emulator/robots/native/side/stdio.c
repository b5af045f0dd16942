// Output of a program goes to the run folder, or to a stream of its own; none reaches the
// emulator's output. Weak: a program may define functions of the same names.
#include <stdio.h>

#include <string.h>

#include "side.h"

#define WEAK __attribute__((weak))

enum { LINE_BYTES = 512, FORMAT_BYTES = 256, OPENED = 4 };

static FILE run_folder;
FILE *kt_streams[3] = {&run_folder, &run_folder, &run_folder};

// Streams of fdevopen(); the robot would take them from its heap.
static FILE opened[OPENED];
static uint8_t used;

WEAK FILE *fdevopen(int (*put)(char, FILE *), int (*get)(FILE *)) {
    if (used == OPENED) return NULL;
    FILE *stream = &opened[used++];
    fdev_setup_stream(stream, put, get, _FDEV_SETUP_RW);
    if (get != NULL && stdin == &run_folder) stdin = stream;
    if (put != NULL && stdout == &run_folder) stdout = stderr = stream;
    return stream;
}

WEAK int fclose(FILE *stream) {
    (void)stream;
    return 0;
}

// The serial line of this robot, KT_LINE_....
static uint8_t line_used = KT_NO_LINE;

// Labs' ways to set up the serial port before printing.
void debug_init(void);
WEAK void debug_init(void) { line_used = KT_LINE_WAITS; }
void debug_init_nonblocking(void);
WEAK void debug_init_nonblocking(void) { line_used = KT_LINE_QUEUES; }

// A stream without a put function is the run folder.
static void write_text(FILE *stream, const char *text, size_t bytes) {
    if (stream == NULL || stream->put == NULL) {
        kt_print(text, (uint32_t)bytes, line_used);
        return;
    }
    for (size_t i = 0; i < bytes; i++) stream->put(text[i], stream);
}

// The PC's vsnprintf() by its internal name, since this file defines the usual one.
extern int pc_vsnprintf(char *text, size_t bytes, const char *format,
                        va_list arguments) __asm__("__vsnprintf");

// A long has 32 bits on the robot, and programs print int32_t and uint32_t by `%ld`: the `l` is
// removed, so that 32 bits are taken here too. `%S` is a string in flash, `%s` here.
static const char *robots_format(const char *format, char *changed) {
    if (strlen(format) >= FORMAT_BYTES) return format;
    char *end = changed;
    while (*format != '\0') {
        if ((*end++ = *format++) != '%') continue;
        while (*format != '\0' && strchr("-+ #.*0123456789", *format) != NULL) *end++ = *format++;
        if (*format == 'l' && format[1] != 'l') format++;
        if (*format == '\0') break;
        *end++ = *format == 'S' ? 's' : *format;
        format++;
    }
    *end = '\0';
    return changed;
}

WEAK int vsnprintf(char *text, size_t bytes, const char *format, va_list arguments) {
    char changed[FORMAT_BYTES];
    return pc_vsnprintf(text, bytes, robots_format(format, changed), arguments);
}

WEAK int vsprintf(char *text, const char *format, va_list arguments) {
    return vsnprintf(text, INT32_MAX, format, arguments);
}

WEAK int snprintf(char *text, size_t bytes, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    int length = vsnprintf(text, bytes, format, arguments);
    va_end(arguments);
    return length;
}

WEAK int sprintf(char *text, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    int length = vsprintf(text, format, arguments);
    va_end(arguments);
    return length;
}

// Longer texts are cut off.
WEAK int vfprintf(FILE *stream, const char *format, va_list arguments) {
    char line[LINE_BYTES];
    int length = vsnprintf(line, sizeof line, format, arguments);
    if (length > 0) write_text(stream, line, length < LINE_BYTES ? (size_t)length : LINE_BYTES - 1);
    return length;
}

WEAK int vprintf(const char *format, va_list arguments) {
    return vfprintf(stdout, format, arguments);
}

WEAK int printf(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    int length = vprintf(format, arguments);
    va_end(arguments);
    return length;
}

WEAK int fprintf(FILE *stream, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    int length = vfprintf(stream, format, arguments);
    va_end(arguments);
    return length;
}

WEAK int fputs(const char *text, FILE *stream) {
    write_text(stream, text, strlen(text));
    return 1;
}

// In one piece: the run folder keeps one event per call.
WEAK int puts(const char *text) {
    char line[LINE_BYTES];
    size_t length = strlen(text);
    if (length > LINE_BYTES - 1) length = LINE_BYTES - 1;
    memcpy(line, text, length);
    line[length] = '\n';
    write_text(stdout, line, length + 1);
    return 1;
}

WEAK int fputc(int character, FILE *stream) {
    char byte = (char)character;
    write_text(stream, &byte, 1);
    return character;
}

WEAK int putc(int character, FILE *stream) { return fputc(character, stream); }
WEAK int putchar(int character) { return fputc(character, stdout); }

WEAK size_t fwrite(const void *data, size_t size, size_t count, FILE *stream) {
    write_text(stream, data, size * count);
    return count;
}

// Nothing is buffered.
WEAK int fflush(FILE *stream) {
    (void)stream;
    return 0;
}

// A stream without a get function is at its end.
WEAK int fgetc(FILE *stream) {
    if (stream != NULL && stream->unread) {
        stream->unread = 0;
        return stream->given_back;
    }
    int character = stream == NULL || stream->get == NULL ? EOF : stream->get(stream);
    return character < 0 ? EOF : character;
}

WEAK int getc(FILE *stream) { return fgetc(stream); }
WEAK int getchar(void) { return fgetc(stdin); }

WEAK char *fgets(char *text, int bytes, FILE *stream) {
    int length = 0;
    while (length < bytes - 1) {
        int character = fgetc(stream);
        if (character == EOF) break;
        text[length++] = (char)character;
        if (character == '\n') break;
    }
    if (length == 0) return NULL;
    text[length] = '\0';
    return text;
}

WEAK char *gets(char *text) {
    if (fgets(text, INT16_MAX, stdin) == NULL) return NULL;
    text[strcspn(text, "\n")] = '\0';
    return text;
}

// Whole elements only, as the standard says; the rest of a broken one is lost.
WEAK size_t fread(void *data, size_t size, size_t count, FILE *stream) {
    uint8_t *byte = data;
    for (size_t i = 0; i < size * count; i++) {
        int character = fgetc(stream);
        if (character == EOF) return i / size;
        *byte++ = (uint8_t)character;
    }
    return count;
}

// One character of push-back, as in avr-libc.
WEAK int ungetc(int character, FILE *stream) {
    if (character == EOF || stream == NULL || stream->unread) return EOF;
    stream->given_back = (uint8_t)character;
    stream->unread = 1;
    return stream->given_back;
}

// A line at a time: the robot's reads the stream character by character.
WEAK int vfscanf(FILE *stream, const char *format, va_list arguments) {
    char line[LINE_BYTES];
    return fgets(line, sizeof line, stream) == NULL ? EOF : vsscanf(line, format, arguments);
}

WEAK int vscanf(const char *format, va_list arguments) { return vfscanf(stdin, format, arguments); }

WEAK int fscanf(FILE *stream, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    int count = vfscanf(stream, format, arguments);
    va_end(arguments);
    return count;
}

WEAK int scanf(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    int count = vscanf(format, arguments);
    va_end(arguments);
    return count;
}
