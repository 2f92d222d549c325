/**
 * Matrices of four columns in double precision. Sums are in the order of the Rust crate's, so that both
 * round alike.
 */
export type Mat4 = number[];

/** Returns the matrix that moves points. */
export function translation([x, y, z]: readonly number[]): Mat4 {
  return [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1];
}

/** Returns the matrix that scales points. */
export function scale([x, y, z]: readonly number[]): Mat4 {
  return [x, 0, 0, 0, 0, y, 0, 0, 0, 0, z, 0, 0, 0, 0, 1];
}

/** Returns the product of two matrices. */
export function multiply(a: Mat4, b: Mat4): Mat4 {
  const product: Mat4 = [];
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      let sum = a[row] * b[4 * column];
      for (let k = 1; k < 4; k++) sum += a[4 * k + row] * b[4 * column + k];
      product.push(sum);
    }
  }
  return product;
}

/** Returns an affine matrix times a point. */
export function transformPoint(m: Mat4, [x, y, z]: readonly number[]): number[] {
  return [0, 1, 2].map((row) => m[12 + row] + (m[8 + row] * z + (m[4 + row] * y + m[row] * x)));
}

/** Returns the entry of column `c` and row `r` of the matrix that `minor` and its callers name so. */
function at(m: Mat4, c: number, r: number): number {
  return m[4 * c + r];
}

/** Returns the minor of the columns c1 and c2 in the rows r1 and r2. */
function minor(m: Mat4, c1: number, c2: number, r1: number, r2: number): number {
  return at(m, c1, r1) * at(m, c2, r2) - at(m, c2, r1) * at(m, c1, r2);
}

/** Returns the determinant, expanded along the first column. */
export function determinant(m: Mat4): number {
  const pair = (r1: number, r2: number) => at(m, 2, r1) * at(m, 3, r2) - at(m, 2, r2) * at(m, 3, r1);
  const triple = (r1: number, r2: number, r3: number) =>
    at(m, 1, r1) * pair(r2, r3) - at(m, 1, r2) * pair(r1, r3) + at(m, 1, r3) * pair(r1, r2);
  return (
    at(m, 0, 0) * triple(1, 2, 3) -
    at(m, 0, 1) * triple(0, 2, 3) +
    at(m, 0, 2) * triple(0, 1, 3) -
    at(m, 0, 3) * triple(0, 1, 2)
  );
}

/** Returns the inverse: the cofactors over the determinant. */
export function inverse(m: Mat4): Mat4 {
  const cofactors: Mat4 = [];
  for (let c = 0; c < 4; c++) {
    // Column c of the result is the cofactors of row c, over the other rows.
    const [r1, r2, r3] = [0, 1, 2, 3].filter((row) => row !== c);
    for (let r = 0; r < 4; r++) {
      // The first column of the expansion, and the two of the minors.
      const [first, c1, c2] = [0, 1, 2, 3].filter((column) => column !== r);
      const sum =
        at(m, first, r1) * minor(m, c1, c2, r2, r3) -
        at(m, first, r2) * minor(m, c1, c2, r1, r3) +
        at(m, first, r3) * minor(m, c1, c2, r1, r2);
      cofactors.push((r + c) % 2 === 0 ? sum : -sum);
    }
  }
  const det =
    m[0] * cofactors[0] + m[1] * cofactors[4] + m[2] * cofactors[8] + m[3] * cofactors[12];
  const perDet = 1 / det;
  return cofactors.map((v) => v * perDet);
}
