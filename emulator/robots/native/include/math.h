/// math.h of avr-libc, and no more: a program is free to name variables y0, y1 or gamma.
///
/// A double has 64 bits here, 32 on the robot.
#ifndef KT_MATH_H
#define KT_MATH_H

#define M_E 2.7182818284590452354
#define M_LOG2E 1.4426950408889634074
#define M_LOG10E 0.43429448190325182765
#define M_LN2 0.69314718055994530942
#define M_LN10 2.30258509299404568402
#define M_PI 3.14159265358979323846
#define M_PI_2 1.57079632679489661923
#define M_PI_4 0.78539816339744830962
#define M_1_PI 0.31830988618379067154
#define M_2_PI 0.63661977236758134308
#define M_2_SQRTPI 1.12837916709551257390
#define M_SQRT2 1.41421356237309504880
#define M_SQRT1_2 0.70710678118654752440

#define NAN __builtin_nanf("")
#define INFINITY __builtin_inff()
#define HUGE_VAL __builtin_huge_val()

#define isnan(number) __builtin_isnan(number)
#define isinf(number) __builtin_isinf_sign(number)
#define isfinite(number) __builtin_isfinite(number)
#define signbit(number) __builtin_signbit(number)

double acos(double x);
double asin(double x);
double atan(double x);
double atan2(double y, double x);
double cbrt(double x);
double ceil(double x);
double copysign(double x, double sign);
double cos(double x);
double cosh(double x);
double exp(double x);
double fabs(double x);
double fdim(double x, double y);
double floor(double x);
double fma(double x, double y, double z);
double fmax(double x, double y);
double fmin(double x, double y);
double fmod(double x, double y);
double frexp(double x, int *exponent);
double hypot(double x, double y);
double ldexp(double x, int exponent);
double log(double x);
double log10(double x);
long lrint(double x);
long lround(double x);
double modf(double x, double *whole);
double pow(double x, double y);
double round(double x);
double sin(double x);
double sinh(double x);
double sqrt(double x);
double square(double x);  ///< x * x
double tan(double x);
double tanh(double x);
double trunc(double x);

float acosf(float x);
float asinf(float x);
float atanf(float x);
float atan2f(float y, float x);
float cbrtf(float x);
float ceilf(float x);
float copysignf(float x, float sign);
float cosf(float x);
float coshf(float x);
float expf(float x);
float fabsf(float x);
float fdimf(float x, float y);
float floorf(float x);
float fmaf(float x, float y, float z);
float fmaxf(float x, float y);
float fminf(float x, float y);
float fmodf(float x, float y);
float frexpf(float x, int *exponent);
float hypotf(float x, float y);
float ldexpf(float x, int exponent);
float logf(float x);
float log10f(float x);
long lrintf(float x);
long lroundf(float x);
float modff(float x, float *whole);
float powf(float x, float y);
float roundf(float x);
float sinf(float x);
float sinhf(float x);
float sqrtf(float x);
float squaref(float x);
float tanf(float x);
float tanhf(float x);
float truncf(float x);

#define isnanf(number) isnan(number)
#define isinff(number) isinf(number)
#define isfinitef(number) isfinite(number)
#define signbitf(number) signbit(number)

#endif
