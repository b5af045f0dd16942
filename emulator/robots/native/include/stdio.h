/// stdio.h of avr-libc: a stream is a pair of the program's own functions for single characters.
/// Output to a stream without such a function, as stdout is at the start, is kept in the run
/// folder.
///
/// In formats, `%ld` and the like take 32 bits, as wide as a long is on the robot.
#ifndef KT_STDIO_H
#define KT_STDIO_H

#include <inttypes.h>
#include <stdarg.h>
#include <stddef.h>

typedef struct kt_stream FILE;

struct kt_stream {
    int (*put)(char character, FILE *stream);  ///< may be NULL
    int (*get)(FILE *stream);                  ///< may be NULL
    void *udata;
    uint8_t flags;
    uint8_t given_back;  ///< by ungetc()
    uint8_t unread;      ///< 1: `given_back` comes next
};

extern FILE *kt_streams[3];

#define stdin (kt_streams[0])
#define stdout (kt_streams[1])
#define stderr (kt_streams[2])

#define EOF (-1)
#define SEEK_SET 0
#define SEEK_CUR 1
#define SEEK_END 2

#define _FDEV_SETUP_READ 1
#define _FDEV_SETUP_WRITE 2
#define _FDEV_SETUP_RW (_FDEV_SETUP_READ | _FDEV_SETUP_WRITE)
#define _FDEV_ERR (-1)
#define _FDEV_EOF (-2)

#define FDEV_SETUP_STREAM(put_function, get_function, mode) \
    { (put_function), (get_function), NULL, (mode) }
#define fdev_setup_stream(stream, put_function, get_function, mode) \
    do {                                                            \
        (stream)->put = (put_function);                             \
        (stream)->get = (get_function);                             \
        (stream)->udata = NULL;                                     \
        (stream)->flags = (mode);                                   \
        (stream)->unread = 0;                                       \
    } while (0)
#define fdev_set_udata(stream, data) ((void)((stream)->udata = (data)))
#define fdev_get_udata(stream) ((stream)->udata)
#define fdev_close() ((void)0)

/// The first stream that can write becomes stdout and stderr, the first that can read stdin. NULL
/// after four.
FILE *fdevopen(int (*put)(char, FILE *), int (*get)(FILE *));
int fclose(FILE *stream);

int printf(const char *format, ...);
int fprintf(FILE *stream, const char *format, ...);
int vprintf(const char *format, va_list arguments);
int vfprintf(FILE *stream, const char *format, va_list arguments);
int putchar(int character);
int putc(int character, FILE *stream);
int fputc(int character, FILE *stream);
int puts(const char *text);
int fputs(const char *text, FILE *stream);
size_t fwrite(const void *data, size_t size, size_t count, FILE *stream);
int fflush(FILE *stream);

/// Input comes only from a program's own `get`.
int getchar(void);
int getc(FILE *stream);
int fgetc(FILE *stream);
char *fgets(char *text, int bytes, FILE *stream);
char *gets(char *text);
size_t fread(void *data, size_t size, size_t count, FILE *stream);
int ungetc(int character, FILE *stream);

#define ferror(stream) ((void)(stream), 0)
#define feof(stream) ((void)(stream), 0)
#define clearerr(stream) ((void)(stream))

int sprintf(char *text, const char *format, ...);
int snprintf(char *text, size_t bytes, const char *format, ...);
int vsprintf(char *text, const char *format, va_list arguments);
int vsnprintf(char *text, size_t bytes, const char *format, va_list arguments);

int sscanf(const char *text, const char *format, ...);
int vsscanf(const char *text, const char *format, va_list arguments);
/// From a line of the stream.
int scanf(const char *format, ...);
int fscanf(FILE *stream, const char *format, ...);
int vscanf(const char *format, va_list arguments);
int vfscanf(FILE *stream, const char *format, va_list arguments);

#define printf_P printf
#define fprintf_P fprintf
#define sprintf_P sprintf
#define snprintf_P snprintf
#define vfprintf_P vfprintf
#define vsprintf_P vsprintf
#define vsnprintf_P vsnprintf
#define puts_P puts
#define fputs_P fputs
#define sscanf_P sscanf
#define scanf_P scanf
#define fscanf_P fscanf
#define vfscanf_P vfscanf

#endif
