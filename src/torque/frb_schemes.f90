!> Splitting schemes: symmetric compositions of the drift (the free body, coefficients a) and the kick (the
!> torque, coefficients b, and c where the kick is modified): named schemes, and schemes from a user's
!> coefficients.
!>
!> `splitting_scheme('srkn14')` gives a named scheme, `splitting_scheme(a, b)` checks and takes a user's own.
!> A palindrome is stored once, up to its centre.
!>
!> | name     | form | kicks | order | needs Nystroem | source |
!> |----------|------|-------|-------|----------------|--------|
!> | strang   | ABA  | 1     | 2     | no             | drift by h/2, kick by h, drift by h/2 |
!> | yoshida4 | ABA  | 3     | 4     | no             | strang composed three times (Forest-Ruth, Yoshida) |
!> | srkn6    | BAB  | 6     | 4     | yes            | Blanes, Moan 2002, SRKN6b |
!> | s6       | ABA  | 6     | 4     | no             | Blanes, Moan 2002, S6 |
!> | srkn11   | BAB  | 11    | 6     | yes            | Blanes, Moan 2002, SRKN11b |
!> | srkn14   | ABA  | 14    | 6     | yes            | Blanes, Moan 2002, SRKN14a: (23), a_4 corrected |
!> | srkn17   | BAB  | 17    | 8     | yes            | Blanes, Casas, Escorihuela-Tomas 2022 |
!> | aba864   | ABA  | 7     | 4     | no             | Blanes et al. 2013; (8, 6, 4) for a small torque |
!> | aba1064  | ABA  | 8     | 4     | no             | Blanes et al. 2013; (10, 6, 4) for a small torque |
!> | fg4      | BAB  | 4     | 4     | yes, modified  | Omelyan, Mryglod, Folk 2002, 2003 |
!> | fg6a     | ABA  | 5     | 6     | yes, modified  | Omelyan, Mryglod, Folk 2002, 2003 |
!> | fg6b     | BAB  | 5     | 6     | yes, modified  | Omelyan, Mryglod, Folk 2002, 2003 |
!> | fg8      | ABA  | 11    | 8     | yes, modified  | Omelyan, Mryglod, Folk 2002, 2003 |
!>
!> A modified kick is m += b h tau + c h^3 g with g = 2 (D_n tau + n x tau), n = I^-1 tau, D_n tau the change
!> of the torque as the body turns about n: see frb_modified_kicks. Coefficients of fg6a, fg6b and fg8 were
!> brought from 16 digits to 30 by Newton's method on the order conditions; free coefficients did not change.
!>
!> frb_splitting says when to use which scheme.
!>
!> Sources: S. Blanes, P. C. Moan, J. Comput. Appl. Math. 142 (2002) 313; S. Blanes et al., Appl. Numer. Math.
!> 68 (2013) 58; S. Blanes, F. Casas, A. Escorihuela-Tomas, arXiv 2202.01541; I. P. Omelyan, I. M. Mryglod,
!> R. Folk, Phys. Rev. E 66 (2002) 026701 and Comput. Phys. Commun. 151 (2003) 272; H. Yoshida, Phys. Lett. A
!> 150 (1990) 262.
module frb_schemes
    use frb_kinds, only: wp
    use frb_order_conditions, only: order_report, order_conditions
    use frb_status, only: status_ok, status_bad_scheme, status_bad_option
    use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
    implicit none
    private

    public :: splitting_scheme, scheme_names, mirrored, most_stages

    !> No scheme has more drifts or more kicks than this.
    integer, parameter :: most_stages = 64

    !> Names that `splitting_scheme(name)` knows.
    character(8), parameter :: scheme_names(13) = [character(8) :: 'strang', 'yoshida4', 'srkn6', 's6', &
                                                   'srkn11', 'srkn14', 'srkn17', 'aba864', 'aba1064', &
                                                   'fg4', 'fg6a', 'fg6b', 'fg8']

    !> A symmetric splitting scheme. The components are for reading. A scheme that could not be made has
    !> `status /= status_ok`, and `integrate` refuses it with that code.
    type :: splitting_scheme
        integer :: status = status_bad_scheme   !! `status_ok`, or why the scheme could not be made
        character(16) :: name = ''
        logical :: drift_first = .true.         !! ABA: opens and closes with a drift; else BAB, with a kick
        integer :: drifts = 0                   !! drift coefficients of one step
        integer :: kicks = 0                    !! kick coefficients of one step
        real(wp) :: half_a(most_stages/2) = 0.0_wp  !! drift coefficients up to the centre
        real(wp) :: half_b(most_stages/2) = 0.0_wp  !! kick coefficients up to the centre
        real(wp) :: half_c(most_stages/2) = 0.0_wp  !! those of modified kicks, 0 for a plain kick
        integer :: displaced = 2                    !! number of displaced torques of a modified kick, 1 or 2,
                                                    !! if the scene does not provide the change of the torque
    contains
        procedure :: drift_coefficients    !! all of one step, in turn
        procedure :: kick_coefficients    !! all of one step, in turn
        procedure :: modified_coefficients    !! those of modified kicks
        procedure :: has_modified_kicks    !! whether there are any
        procedure :: stages    !! kicks of one step
        procedure :: conditions    !! its order, and the residuals of its order conditions
    end type splitting_scheme

    !> A scheme by its name, `splitting_scheme(name)`, or from coefficients of the user's.
    interface splitting_scheme
        module procedure scheme_by_name
        module procedure scheme_from_coefficients
    end interface splitting_scheme

contains

    !> The scheme with one of the names in `scheme_names`; `status_bad_option` for any other.
    pure function scheme_by_name(name, displaced) result(scheme)
        character(*), intent(in) :: name
        integer, intent(in), optional :: displaced      !! see scheme_from_coefficients
        type(splitting_scheme) :: scheme

        scheme = scheme_of_plain_kicks(name)
        if (scheme%status /= status_ok) scheme = scheme_of_modified_kicks(name)
        scheme%name = name
        call set_displaced(scheme, displaced)
    end function scheme_by_name

    !> The coefficients of a scheme whose kicks are plain; `status_bad_option` for any other name.
    pure function scheme_of_plain_kicks(name) result(scheme)
        character(*), intent(in) :: name
        type(splitting_scheme) :: scheme
        real(wp), parameter :: outer = 1/(2 - 2.0_wp**(1/3.0_wp))

        select case (name)
        case ('strang')
            scheme = closed([real(wp) ::], [real(wp) ::], drift_first=.true.)
        case ('yoshida4')
            scheme = closed([outer/2], [outer], drift_first=.true.)
        case ('srkn6')
            scheme = closed([0.245298957184271_wp, 0.604872665711080_wp], &
                            [0.0829844064174052_wp, 0.396309801498368_wp, -0.0390563049223486_wp], &
                            drift_first=.false.)
        case ('s6')
            scheme = closed([0.0792036964311957_wp, 0.353172906049774_wp, -0.0420650803577195_wp], &
                            [0.209515106613362_wp, -0.143851773179818_wp], drift_first=.true.)
        case ('srkn11')
            scheme = closed([0.123229775946271_wp, 0.290553797799558_wp, -0.127049212625417_wp, &
                             -0.246331761062075_wp, 0.357208872795928_wp], &
                            [0.0414649985182624_wp, 0.198128671918067_wp, -0.0400061921041533_wp, &
                             0.0752539843015807_wp, -0.0115113874206879_wp], drift_first=.false.)
        case ('srkn14')
            scheme = closed([0.0378593198406116_wp, 0.102635633102435_wp, -0.0258678882665587_wp, &
                             0.314241403071447_wp, -0.130144459517415_wp, 0.106417700369543_wp, &
                             -0.00879424312851058_wp], &
                            [0.09171915262446165_wp, 0.183983170005006_wp, -0.05653436583288827_wp, &
                             0.004914688774712854_wp, 0.143761127168358_wp, 0.328567693746804_wp], &
                            drift_first=.true.)
        case ('aba864')
            scheme = closed([0.0711334264982231177779387300061549964174_wp, &
                             0.241153427956640098736487795326289649618_wp, &
                             0.521411761772814789212136078067994229991_wp], &
                            [0.183083687472197221961703757166430291072_wp, &
                             0.310782859898574869507522291054262796375_wp, &
                             -0.0265646185119588006972121379164987592663_wp], drift_first=.true.)
        case ('srkn17')
            scheme = closed([0.160227696073839513690970240076_wp, 0.306354507436867319879440957100_wp, &
                             0.308395508895171191756544975556_wp, 0.120362086566233408450063177659_wp, &
                             -0.622888687549183872072186218718_wp, 0.635560951632990078378672016548_wp, &
                             -0.144226974795419229640437363913_wp, -0.284867527074173816678992817545_wp], &
                            [0.0514196142537210073343152693459_wp, 0.250497030318342871458417941091_wp, &
                             0.512412268300327350035492806653_wp, -0.231597138650894401279645184364_wp, &
                             0.116091323536875759881216298975_wp, -0.0098365173246965763985763034283_wp, &
                             -0.108032771466281638634277563747_wp, 0.249039864198023642002940910070_wp], &
                            drift_first=.false.)
        case ('aba1064')
            scheme = closed([0.03809449742241219545697532230863756534060_wp, &
                             0.1452987161169137492940200726606637497442_wp, &
                             0.2076276957255412507162056113249882065158_wp, &
                             0.4359097036515261592231548624010651844006_wp], &
                            [0.09585888083707521061077150377145884776921_wp, &
                             0.2044461531429987806805077839164344779763_wp, &
                             0.2170703479789911017143385924306336714532_wp], drift_first=.true.)
        case default
            scheme%status = status_bad_option
        end select
    end function scheme_of_plain_kicks

    !> The coefficients of a scheme with modified kicks; `status_bad_option` for any other name.
    pure function scheme_of_modified_kicks(name) result(scheme)
        character(*), intent(in) :: name
        type(splitting_scheme) :: scheme

        select case (name)
        case ('fg4')
            scheme = closed([0.1921125277429464_wp], &
                            [0.05851872613455621_wp, 0.28521622406870908761513176030422_wp], &
                            drift_first=.false., &
                            c=[0.0004339598806816256_wp, 0.0_wp, 0.002427475259663049460339030204038_wp])
        case ('fg6a')
            scheme = closed([0.1098059301577147_wp, 0.48280999402509730858552586969689_wp], &
                            [0.26938165176778525808636935091146_wp, 0.076119363458615468730196615809255_wp], &
                            drift_first=.true., &
                            c=[0.0010112493490330141392501792228877_wp, &
                               -0.0018033781293762994999455254660221_wp, &
                               0.010836501076620441836949067500519_wp])
        case ('fg6b')
            scheme = closed([0.16673812334764911621954699066522_wp, 0.38003893443025958590835674810351_wp], &
                            [0.048001369933520955291208235331346_wp, 0.26339570699353499695020330441696_wp], &
                            drift_first=.false., &
                            c=[-0.0017096931714498439536130329406684_wp, &
                               0.0046680837305198054522440599795562_wp, 0.0_wp])
        case ('fg8')
            scheme = closed([0.41009674738801111928784693005080_wp, -0.34123345756052780489101697378499_wp, &
                             0.25644714021068150492361761631743_wp, 0.27765273975812438394100476242641_wp, &
                             -0.56926266869753773902939657321159_wp], &
                            [0.0048249309817414952912695842664785_wp, 0.17492394861090375603419001374207_wp, &
                             0.29304366370957066164364546204288_wp, 0.047448940168459770284238136482511_wp, &
                             -0.0015299863411743974499219652320477_wp], drift_first=.true., &
                            c=[0.00014743936907797528364717244760736_wp, &
                               0.00023288450531932545357194967600155_wp, &
                               0.0061648659635535962497705619884752_wp, &
                               -0.012307516860831240716732016960034_wp, &
                               -0.000073296648559126385387017161643798_wp, &
                               0.015295860994523744731993293847001_wp])
        case default
            scheme%status = status_bad_option
        end select
    end function scheme_of_modified_kicks

    !> A scheme from all coefficients of one step, in the order of use: one more drift than kicks (ABA) or one
    !> more kick than drifts (BAB). `mirrored` writes out a palindrome given up to its centre.
    !> `status_bad_scheme` unless the coefficients are at most 1e6 in size, symmetric to 1e-14 of the largest
    !> (or of one) and sum to one within `tolerance`, with at most `most_stages` drifts and kicks. Their order
    !> is in the report of `conditions`.
    !>
    !> With c the kicks are modified: as many as b, symmetric to 1e-14, at most 1e6; their sum is free.
    !> `displaced`: number of displaced torques that give the change of the torque if the scene has no
    !> `torque_change`; 2, the default, keep order 6; 1 keeps order 4 and costs less, but is refused where b
    !> is 0 and c is not. Any other number: `status_bad_option`.
    pure function scheme_from_coefficients(a, b, name, tolerance, c, displaced) result(scheme)
        real(wp), intent(in) :: a(:)                    !! drifts
        real(wp), intent(in) :: b(:)                    !! kicks
        character(*), intent(in), optional :: name
        real(wp), intent(in), optional :: tolerance     !! how far from one a sum may be, default 1e-12
        real(wp), intent(in), optional :: c(:)          !! modified kicks, default none
        integer, intent(in), optional :: displaced      !! 1 or 2, default 2
        type(splitting_scheme) :: scheme
        real(wp) :: inconsistency

        scheme%name = 'own'
        if (present(name)) scheme%name = name
        if (abs(size(a) - size(b)) /= 1 .or. min(size(a), size(b)) < 1) return
        if (max(size(a), size(b)) > most_stages) return
        inconsistency = 1.0e-12_wp
        if (present(tolerance)) inconsistency = tolerance
        if (.not. (is_palindrome(a) .and. is_palindrome(b))) return
        if (.not. ieee_is_finite(inconsistency)) return
        if (abs(sum(a) - 1) > inconsistency .or. abs(sum(b) - 1) > inconsistency) return
        if (present(c)) then
            if (size(c) /= size(b)) return
            if (.not. is_palindrome(c)) return
            scheme%half_c(1:(size(c) + 1)/2) = c(1:(size(c) + 1)/2)
        end if
        scheme%status = status_ok
        scheme%drift_first = size(a) > size(b)
        scheme%drifts = size(a)
        scheme%kicks = size(b)
        scheme%half_a(1:(size(a) + 1)/2) = a(1:(size(a) + 1)/2)
        scheme%half_b(1:(size(b) + 1)/2) = b(1:(size(b) + 1)/2)
        call set_displaced(scheme, displaced)
    end function scheme_from_coefficients

    !> Sets the number of displaced torques: any number but 1 and 2 gives `status_bad_option`.
    pure subroutine set_displaced(scheme, displaced)
        type(splitting_scheme), intent(inout) :: scheme
        integer, intent(in), optional :: displaced

        if (.not. present(displaced)) return
        scheme%displaced = displaced
        if (displaced < 1 .or. displaced > 2) scheme%status = status_bad_option
        ! One displaced torque is kicked with b, and turned by c/b.
        if (displaced == 1 .and. any(abs(scheme%half_c) > 1.0e6_wp*abs(scheme%half_b))) then
            scheme%status = status_bad_scheme
        end if
    end subroutine set_displaced

    !> Whether coefficients are finite, not huge, and symmetric.
    pure function is_palindrome(c) result(good)
        real(wp), intent(in) :: c(:)
        logical :: good
        real(wp), parameter :: asymmetry = 1.0e-14_wp, largest_coefficient = 1.0e6_wp
        real(wp) :: largest

        good = all(ieee_is_finite(c))
        if (.not. good) return
        largest = maxval(abs(c))
        good = largest <= largest_coefficient
        if (good) good = all(abs(c - c(size(c):1:-1)) <= asymmetry*max(largest, 1.0_wp))
    end function is_palindrome

    !> A scheme whose last coefficient of each kind up to the centre follows from the sum being one: one at
    !> the centre counts once, one beside it twice.
    pure function closed(a, b, drift_first, c) result(scheme)
        real(wp), intent(in) :: a(:), b(:)          ! up to the centre without the last
        logical, intent(in) :: drift_first
        real(wp), intent(in), optional :: c(:)      ! up to the centre with the last
        type(splitting_scheme) :: scheme
        logical :: centre_is_inner, centre_is_drift

        ! Outer coefficients are one more than inner ones: as many up to the centre means the centre is an
        ! inner one.
        centre_is_inner = size(a) == size(b)
        centre_is_drift = centre_is_inner .neqv. drift_first
        scheme%status = status_ok
        scheme%drift_first = drift_first
        scheme%drifts = 2*size(a) + merge(1, 2, centre_is_drift)
        scheme%kicks = 2*size(b) + merge(2, 1, centre_is_drift)
        scheme%half_a(1:size(a)) = a
        scheme%half_b(1:size(b)) = b
        scheme%half_a(size(a) + 1) = merge(1 - 2*sum(a), 0.5_wp - sum(a), centre_is_drift)
        scheme%half_b(size(b) + 1) = merge(0.5_wp - sum(b), 1 - 2*sum(b), centre_is_drift)
        if (present(c)) scheme%half_c(1:size(c)) = c
    end function closed

    !> All drift coefficients of one step, in the order of use; none for a scheme that could not be made.
    pure function drift_coefficients(self) result(a)
        class(splitting_scheme), intent(in) :: self
        real(wp) :: a(self%drifts)

        if (self%status == status_ok) a = mirrored(self%half_a, self%drifts)
    end function drift_coefficients

    !> All kick coefficients of one step, in the order of use; none for a scheme that could not be made.
    pure function kick_coefficients(self) result(b)
        class(splitting_scheme), intent(in) :: self
        real(wp) :: b(self%kicks)

        if (self%status == status_ok) b = mirrored(self%half_b, self%kicks)
    end function kick_coefficients

    !> The coefficients c of modified kicks of one step, in the order of use, 0 for a plain kick; none for a
    !> scheme that could not be made.
    pure function modified_coefficients(self) result(c)
        class(splitting_scheme), intent(in) :: self
        real(wp) :: c(self%kicks)

        if (self%status == status_ok) c = mirrored(self%half_c, self%kicks)
    end function modified_coefficients

    !> Whether any kick is modified.
    pure function has_modified_kicks(self) result(modified)
        class(splitting_scheme), intent(in) :: self
        logical :: modified

        modified = any(abs(self%half_c(:(self%kicks + 1)/2)) > 0.0_wp)
    end function has_modified_kicks

    !> Kicks per step in a chain of steps, where a kick that closes a step and the one that opens
    !> the next are one.
    pure function stages(self) result(count)
        class(splitting_scheme), intent(in) :: self
        integer :: count

        count = min(self%drifts, self%kicks)
    end function stages

    !> The order of the scheme, its order under the Nystroem condition (which a body under torque fulfils),
    !> its orders for a small torque, and the residuals of the order conditions. A condition counts as met
    !> within `tolerance`, 1e-12 by default. Takes a few milliseconds.
    pure function conditions(self, tolerance) result(report)
        class(splitting_scheme), intent(in) :: self
        real(wp), intent(in), optional :: tolerance
        type(order_report) :: report

        if (self%status == status_ok) then
            report = order_conditions(self%drift_coefficients(), self%kick_coefficients(), self%drift_first, &
                                      tolerance, self%modified_coefficients())
        end if
    end function conditions

    !> The palindrome of `count` coefficients whose first half, the centre included, is `half`.
    pure function mirrored(half, count) result(full)
        real(wp), intent(in) :: half(:)     !! size at least (count + 1)/2, else all is NaN
        integer, intent(in) :: count
        real(wp) :: full(count)
        integer :: i

        if (size(half) >= (count + 1)/2) then
            do i = 1, count
                full(i) = half(min(i, count + 1 - i))
            end do
        else
            full = ieee_value(full, ieee_quiet_nan)
        end if
    end function mirrored

end module frb_schemes
