// HDRP's binomial filter of order 8.
const int HDRP_RADIUS = 4;
const float HDRP_WEIGHTS[9] = float[](0.00390625, 0.03125, 0.109375, 0.21875, 0.2734375, 0.21875,
                                      0.109375, 0.03125, 0.00390625);
