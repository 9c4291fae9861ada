// Filament's 3 x 3 bilinear taps, FILAMENT_OFFSET texels apart: their shares along an axis.
const float FILAMENT_SHARES[3] =
    float[](FILAMENT_OUTER, 1.0 - 2.0 * FILAMENT_OUTER, FILAMENT_OUTER);
