!> Explicit interfaces of the LAPACK routines that the library calls. All kinds are named: compiler flags that
!> change the default kinds do not change the interfaces.
module frb_lapack
    use frb_kinds, only: wp
    use, intrinsic :: iso_fortran_env, only: int32
    implicit none
    private

    public :: dsyev, dstev, dposv

    interface
        !> Eigenvalues (ascending) and eigenvectors of a real symmetric matrix.
        pure subroutine dsyev(jobz, uplo, n, a, lda, w, work, lwork, info)
            import :: int32, wp
            implicit none
            character, intent(in) :: jobz, uplo
            integer(int32), intent(in) :: n, lda, lwork
            real(wp), intent(inout) :: a(lda, *)
            real(wp), intent(out) :: w(*), work(*)
            integer(int32), intent(out) :: info
        end subroutine dsyev

        !> Eigenvalues (ascending) and eigenvectors of a real symmetric tridiagonal matrix.
        pure subroutine dstev(jobz, n, d, e, z, ldz, work, info)
            import :: int32, wp
            implicit none
            character, intent(in) :: jobz
            integer(int32), intent(in) :: n, ldz
            real(wp), intent(inout) :: d(*), e(*)
            real(wp), intent(out) :: z(ldz, *), work(*)
            integer(int32), intent(out) :: info
        end subroutine dstev

        !> Solution of a system with a symmetric positive definite matrix, by Cholesky's decomposition.
        pure subroutine dposv(uplo, n, nrhs, a, lda, b, ldb, info)
            import :: int32, wp
            implicit none
            character, intent(in) :: uplo
            integer(int32), intent(in) :: n, nrhs, lda, ldb
            real(wp), intent(inout) :: a(lda, *), b(ldb, *)
            integer(int32), intent(out) :: info
        end subroutine dposv
    end interface

end module frb_lapack
