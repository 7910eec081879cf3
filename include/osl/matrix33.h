// Matrices of three rows, held in the upper left of one of four.
#pragma once
#ifndef OVERCOAT_MATRIX33_H
#define OVERCOAT_MATRIX33_H

struct matrix33 {
    matrix m;
};

matrix matrix33to44(matrix33 a)
{
    matrix m = a.m;
    for (int i = 0; i < 3; i++) {
        m[i][3] = 0;
        m[3][i] = 0;
    }
    m[3][3] = 1;
    return m;
}

matrix33 matrix44to33(matrix a)
{
    matrix33 out;
    out.m = a;
    for (int i = 0; i < 3; i++) {
        out.m[i][3] = 0;
        out.m[3][i] = 0;
    }
    out.m[3][3] = 1;
    return out;
}

matrix33 __operator__mul__(matrix33 a, matrix33 b) { return matrix44to33(a.m * b.m); }
matrix33 __operator__mul__(matrix33 a, float b) { return matrix44to33(a.m * b); }
matrix33 __operator__div__(matrix33 a, matrix33 b) { return matrix44to33(a.m / b.m); }
matrix33 __operator__div__(matrix33 a, float b) { return matrix44to33(a.m / b); }
matrix33 __operator__mul__(float a, matrix33 b) { return b * a; }
matrix33 __operator__neg__(matrix33 a) { return a * -1.0; }
int __operator__eq__(matrix33 a, matrix33 b) { return a.m == b.m; }
int __operator__ne__(matrix33 a, matrix33 b) { return a.m != b.m; }
matrix33 transpose(matrix33 a) { return matrix44to33(transpose(a.m)); }
float determinant(matrix33 a) { return determinant(matrix33to44(a)); }
vector transform(matrix33 a, vector b) { return transform(matrix33to44(a), b); }
#endif
