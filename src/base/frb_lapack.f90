!> Explicit interfaces of the LAPACK routines the library calls.
module frb_lapack
    implicit none
    private

    public :: dsyev, dstev, dposv

    interface
        !> Eigenvalues (ascending) and eigenvectors of a real symmetric matrix.
        pure subroutine dsyev(jobz, uplo, n, a, lda, w, work, lwork, info)
            implicit none
            integer, parameter :: dp = kind(1.0d0)
            character, intent(in) :: jobz, uplo
            integer, intent(in) :: n, lda, lwork
            real(dp), intent(inout) :: a(lda, *)
            real(dp), intent(out) :: w(*), work(*)
            integer, intent(out) :: info
        end subroutine dsyev

        !> Eigenvalues (ascending) and eigenvectors of a real symmetric tridiagonal matrix.
        pure subroutine dstev(jobz, n, d, e, z, ldz, work, info)
            implicit none
            integer, parameter :: dp = kind(1.0d0)
            character, intent(in) :: jobz
            integer, intent(in) :: n, ldz
            real(dp), intent(inout) :: d(*), e(*)
            real(dp), intent(out) :: z(ldz, *), work(*)
            integer, intent(out) :: info
        end subroutine dstev

        !> Solution of a system with a symmetric positive definite matrix, by Cholesky's decomposition.
        pure subroutine dposv(uplo, n, nrhs, a, lda, b, ldb, info)
            implicit none
            integer, parameter :: dp = kind(1.0d0)
            character, intent(in) :: uplo
            integer, intent(in) :: n, nrhs, lda, ldb
            real(dp), intent(inout) :: a(lda, *), b(ldb, *)
            integer, intent(out) :: info
        end subroutine dposv
    end interface

end module frb_lapack
