/* Included by the program, as labs do with what several programs share. */
#define PI 3.14159265359

double uniform_distribution(double a, double b) {
    return a + (b - a) * ((double)rand_hard() / 255);
}

double wrapped_cauchy() {
    double gamma = 0.69314718056;
    double theta = fmod(gamma * tan(PI * uniform_distribution(0, 1) - PI / 2), 2 * PI);
    if (theta > PI)
        theta -= 2 * PI;
    else if (theta < -PI)
        theta += 2 * PI;
    debug_info_set(theta_that_no_struct_has, theta);
    return theta;
}
