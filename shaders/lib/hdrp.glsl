// HDRP's binomial filter of order 8.
const int HDRP_RADIUS = 4;
const float HDRP_WEIGHTS[9] = float[](HDRP_KERNEL);
